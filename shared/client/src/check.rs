//! Checks a message from another process before the program receives it.

use messages::{
    FrameHeader, MAX_CANDIDATES, MAX_KEYPOINTS, MAX_PARTS, MAX_VIEW_KEYPOINTS, Sightings,
    SkeletonMessage, Skeletons, Stamp, Status,
};
use runfiles::Running;

/// Returns true if a message belongs to this run and to this view.
pub(crate) fn stamp(stamp: &Stamp, running: &Running, view: usize) -> bool {
    stamp.session == running.session && stamp.view as usize == view
}

/// Returns true if the counts of skeletons match the deployment, if ids are unique, and if all numbers are finite.
pub(crate) fn skeletons(message: &Skeletons, running: &Running) -> bool {
    let n_people = message.n_people as usize;
    let people = message.listed();
    let is_person = |(nth, person): (usize, &SkeletonMessage)| {
        let is_named_once = people[..nth].iter().all(|other| other.id != person.id);
        is_named_once && skeleton(person, running)
    };
    n_people == people.len() && people.iter().enumerate().all(is_person)
}

fn skeleton(person: &SkeletonMessage, running: &Running) -> bool {
    let fits = person.n_joints as usize == running.joints.len()
        && person.n_views as usize == running.views.len()
        && person.n_keypoints as usize <= MAX_KEYPOINTS;
    let joints = person.listed_joints().iter();
    let mut found = joints
        .chain(person.listed_keypoints())
        .filter(|joint| joint.status == Status::OK);
    let are_finite = found.all(|joint| {
        let mut numbers = joint.in_world.iter().chain(&joint.covariance);
        numbers.all(|number| number.is_finite()) && joint.reprojection_px.is_finite()
    });
    let views = person.listed_views().iter();
    let mut seen = views.filter(|view| view.status == Status::OK);
    let are_placed = seen.all(|view| {
        let n_parts = view.n_parts as usize;
        n_parts <= MAX_PARTS
            && view.centres_px[..n_parts]
                .as_flattened()
                .iter()
                .all(|number| number.is_finite())
    });
    fits && are_finite && are_placed
}

/// Returns true if the counts of a view's pose fit into the message.
pub(crate) fn pose(message: &Sightings) -> bool {
    let n_candidates = message.n_candidates as usize;
    let n_keypoints = message.n_keypoints as usize;
    n_candidates <= MAX_CANDIDATES
        && n_keypoints <= MAX_VIEW_KEYPOINTS
        && message.candidates[..n_candidates].iter().all(|candidate| {
            usize::from(candidate.n_parts) <= MAX_PARTS && candidate.score.is_finite()
        })
}

/// Returns true if a picture is as large as its header says. A picture without pixels may be empty.
pub(crate) fn picture(header: &FrameHeader, len: usize) -> bool {
    let [width, height] = [header.width, header.height].map(|side| side as usize);
    let expected = width.checked_mul(height).and_then(|area| area.checked_mul(3));
    if header.status == Status::OK {
        len > 0 && expected == Some(len)
    } else {
        true
    }
}

#[cfg(test)]
pub(crate) mod tests {
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

    /// A frame with one person.
    pub(crate) fn skeletons(frame: u64) -> Skeletons {
        let mut message = Skeletons {
            n_people: 1,
            ..Skeletons::default()
        };
        message.stamp.session = 7;
        message.stamp.frame = frame;
        let person = &mut message.people[0];
        (person.id, person.n_joints, person.n_views) = (1, 2, 2);
        person.joints[0] = Joint3d {
            in_world: [0.0, 0.0, 1.7],
            covariance: [1e-4, 0.0, 0.0, 1e-4, 0.0, 4e-4],
            reprojection_px: 1.0,
            views_used: 3,
            status: Status::OK,
        };
        person.joints[1].status = Status::TOO_FEW_VIEWS;
        message
    }

    #[test]
    fn messages_of_another_run_or_view_are_rejected() {
        let mut it = skeletons(3).stamp;
        assert!(stamp(&it, &running(), 0));
        assert!(!stamp(&it, &running(), 1));
        it.session = 8;
        assert!(!stamp(&it, &running(), 0));
    }

    #[test]
    fn impossible_counts_and_numbers_are_refused() {
        let running = running();
        assert!(super::skeletons(&skeletons(0), &running));
        let none = Skeletons {
            status: Status::TOO_FEW_VIEWS,
            ..Skeletons::default()
        };
        assert!(super::skeletons(&none, &running));
        let changes: [fn(&mut Skeletons); 8] = [
            |frame| frame.n_people = 9,
            |frame| {
                frame.people[1] = frame.people[0];
                frame.n_people = 2;
            },
            |frame| frame.people[0].n_joints = 3,
            |frame| frame.people[0].n_joints = u32::MAX,
            |frame| frame.people[0].n_views = 17,
            |frame| frame.people[0].n_keypoints = 1000,
            |frame| frame.people[0].joints[0].in_world[1] = f64::NAN,
            |frame| frame.people[0].views[1].n_parts = 33,
        ];
        for (nth, change) in changes.iter().enumerate() {
            let mut message = skeletons(0);
            change(&mut message);
            assert!(!super::skeletons(&message, &running), "change {nth}");
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
        fn any_bytes_are_accepted_or_refused_without_panic(bytes in prop::collection::vec(any::<u8>(), size_of::<Skeletons>())) {
            let message: Skeletons = bytemuck::pod_read_unaligned(&bytes);
            super::skeletons(&message, &running());
            let n = size_of::<Sightings>().min(bytes.len());
            if n == size_of::<Sightings>() {
                let message: Sightings = bytemuck::pod_read_unaligned(&bytes[..n]);
                pose(&message);
            }
        }
    }
}
