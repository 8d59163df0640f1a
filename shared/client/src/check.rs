//! What must hold of a message from another process before it is given to a program.

use messages::{
    FrameHeader, MAX_CANDIDATES, MAX_JOINTS, MAX_KEYPOINTS, MAX_PARTS, MAX_VIEW_KEYPOINTS,
    MAX_VIEWS, Pose3d, Stamp, Status, ViewPose,
};
use runfiles::Running;

/// Whether a message is of this run, and of this view.
pub(crate) fn stamp(stamp: &Stamp, running: &Running, view: usize) -> bool {
    stamp.session == running.session && stamp.view as usize == view
}

/// Whether the counts of a skeleton are those of the deployment, and its numbers are numbers.
pub(crate) fn skeleton(message: &Pose3d, running: &Running) -> bool {
    let (n_joints, n_views) = (message.n_joints as usize, message.n_views as usize);
    let n_keypoints = message.n_keypoints as usize;
    if n_joints > MAX_JOINTS || n_views > MAX_VIEWS || n_keypoints > MAX_KEYPOINTS {
        return false;
    }
    // A frame without a skeleton may have no joints and no views.
    let is_empty = message.status != Status::OK && n_joints == 0 && n_views == 0;
    let fits = n_joints == running.joints.len() && n_views == running.views.len();
    let joints = message.joints[..n_joints].iter();
    let mut found = joints
        .chain(&message.keypoints[..n_keypoints])
        .filter(|it| it.status == Status::OK);
    let finite = found.all(|it| {
        let mut numbers = it.in_world.iter().chain(&it.covariance);
        numbers.all(|it| it.is_finite()) && it.reprojection_px.is_finite()
    });
    let views = message.views[..n_views].iter();
    let mut seen = views.filter(|it| it.status == Status::OK);
    let placed = seen.all(|it| {
        let n_parts = it.n_parts as usize;
        n_parts <= MAX_PARTS
            && it.centres_px[..n_parts]
                .as_flattened()
                .iter()
                .all(|it| it.is_finite())
    });
    (is_empty || fits) && finite && placed
}

/// Whether the counts of a view's pose fit into it.
pub(crate) fn pose(message: &ViewPose) -> bool {
    let n_candidates = message.n_candidates as usize;
    let n_keypoints = message.n_keypoints as usize;
    n_candidates <= MAX_CANDIDATES
        && n_keypoints <= MAX_VIEW_KEYPOINTS
        && message.candidates[..n_candidates]
            .iter()
            .all(|it| usize::from(it.n_parts) <= MAX_PARTS && it.score.is_finite())
}

/// Whether a picture is as large as its header says; one without pixels may be empty.
pub(crate) fn picture(header: &FrameHeader, len: usize) -> bool {
    let [width, height] = [header.width, header.height].map(|side| side as usize);
    let expected = width
        .checked_mul(height)
        .and_then(|area| area.checked_mul(3));
    if header.status == Status::OK {
        len > 0 && expected == Some(len)
    } else {
        true
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use bytemuck::Zeroable as _;
    use messages::Joint3d;
    use proptest::prelude::*;
    use runfiles::RunningView;

    use super::*;

    pub(crate) fn running() -> Running {
        let view = |name: &str| RunningView {
            height: 2,
            name: name.to_owned(),
            width: 4,
        };
        Running {
            format: Running::VERSION,
            frame_step: 1,
            joints: vec!["head".to_owned(), "right wrist".to_owned()],
            keypoints: Vec::new(),
            limbs: vec![[0, 1]],
            lossless: false,
            name: "walk".to_owned(),
            output: "out".into(),
            parallax: "0.1.0".to_owned(),
            session: 7,
            views: vec![view("left"), view("right")],
        }
    }

    pub(crate) fn pose3d(frame: u64) -> Pose3d {
        let mut message = Pose3d::zeroed();
        message.stamp.session = 7;
        message.stamp.frame = frame;
        (message.n_joints, message.n_views) = (2, 2);
        message.joints[0] = Joint3d {
            in_world: [0.0, 0.0, 1.7],
            covariance: [1e-4, 0.0, 0.0, 1e-4, 0.0, 4e-4],
            reprojection_px: 1.0,
            views_used: 3,
            status: Status::OK,
        };
        message.joints[1].status = Status::TOO_FEW_VIEWS;
        message
    }

    #[test]
    fn a_message_of_another_run_or_view_is_none_of_ours() {
        let mut it = pose3d(3).stamp;
        assert!(stamp(&it, &running(), 0));
        assert!(!stamp(&it, &running(), 1));
        it.session = 8;
        assert!(!stamp(&it, &running(), 0));
    }

    #[test]
    fn counts_and_numbers_that_cannot_be_are_refused() {
        let running = running();
        assert!(skeleton(&pose3d(0), &running));
        let mut none = Pose3d::zeroed();
        none.status = Status::TOO_FEW_VIEWS;
        assert!(skeleton(&none, &running));
        let changes: [fn(&mut Pose3d); 6] = [
            |it| it.n_joints = 3,
            |it| it.n_joints = u32::MAX,
            |it| it.n_views = 17,
            |it| it.n_keypoints = 1000,
            |it| it.joints[0].in_world[1] = f64::NAN,
            |it| {
                it.views[1].n_parts = 33;
            },
        ];
        for (nth, change) in changes.iter().enumerate() {
            let mut message = pose3d(0);
            change(&mut message);
            assert!(!skeleton(&message, &running), "change {nth}");
        }
    }

    #[test]
    fn a_picture_has_the_pixels_that_its_header_promises() {
        let mut header = FrameHeader {
            width: 4,
            height: 2,
            ..FrameHeader::default()
        };
        assert!(picture(&header, 24));
        assert!(!picture(&header, 23) && !picture(&header, 0));
        header.width = u32::MAX;
        header.height = u32::MAX;
        assert!(!picture(&header, 24));
        header.status = Status::UNPLUGGED;
        assert!(picture(&header, 0));
    }

    proptest! {
        #[test]
        fn any_bytes_are_taken_or_refused(bytes in prop::collection::vec(any::<u8>(), size_of::<Pose3d>())) {
            let message: Pose3d = bytemuck::pod_read_unaligned(&bytes);
            skeleton(&message, &running());
            let n = size_of::<ViewPose>().min(bytes.len());
            if n == size_of::<ViewPose>() {
                let message: ViewPose = bytemuck::pod_read_unaligned(&bytes[..n]);
                pose(&message);
            }
        }
    }
}
