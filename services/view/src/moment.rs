//! One frame as the page draws it, with the followed person and other people.

use messages::{FusedView, Joint3d, MAX_PARTS, SkeletonMessage, Skeletons, Status};
use serde::Serialize;

use crate::scene::Scene;

/// One frame: the 3D skeletons, the pose in every view, and reasons for missing data.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Moment {
    /// Always `moment`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Index of the frame in a finished run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<usize>,
    /// Number of the frame in the footage.
    pub frame: u64,
    /// Time of the frame, in seconds after frame 0; `None` if unknown.
    pub seconds: Option<f64>,
    /// Reason for a missing skeleton; `None` if there is a skeleton.
    pub why: Option<String>,
    /// Identity of the followed person; `None` if no person is followed.
    pub id: Option<u64>,
    /// The other people.
    pub others: Vec<Other>,
    /// Position of every joint in world coordinates, in metres; `None` for an unknown joint.
    pub joints: Vec<Option<[f64; 3]>>,
    /// Covariance of every joint, in square metres: xx, xy, xz, yy, yz, zz.
    pub spread: Vec<Option<[f64; 6]>>,
    /// Pose in every view.
    pub views: Vec<Seen>,
    /// Number of people that the views agree on; `None` if they were not counted.
    pub people: Option<u32>,
    /// Height of the person standing upright, in metres; `None` if unknown.
    pub stature: Option<f64>,
    /// Latency from capture to result, in milliseconds; `None` if unknown.
    pub latency_ms: Option<f64>,
}

/// A person other than the followed one.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Other {
    /// Identity of the person.
    pub id: u64,
    /// Position of every joint in world coordinates, in metres; `None` for an unknown joint.
    pub joints: Vec<Option<[f64; 3]>>,
    /// Height of the person standing upright, in metres; `None` if unknown.
    pub stature: Option<f64>,
    /// Joints in every view, in pixels; `None` if a view has no pose.
    pub views: Vec<Option<Vec<Option<[f64; 2]>>>>,
}

/// Pose in one view.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Seen {
    /// Joints, in pixels; `None` if there is no pose, or for a joint whose position is unknown.
    pub joints: Option<Vec<Option<[f64; 2]>>>,
    /// Reason why the view does not contribute to the result; `None` if it does.
    pub why: Option<String>,
    /// True if the view sees the person from behind.
    pub behind: bool,
}

impl Moment {
    /// Name of the message type.
    pub(crate) const KIND: &'static str = "moment";

    /// Converts a message about a frame, with the followed person first. The message must have been checked.
    pub(crate) fn of_message(scene: &Scene, message: &Skeletons) -> Self {
        let person = message.followed();
        // Without a person, no joint has a position.
        let nowhere = vec![Joint3d::default(); scene.joints.joints.len()];
        let joints = person.map_or(&nowhere[..], SkeletonMessage::listed_joints);
        let found = |joint: &&Joint3d| person.is_some() && joint.status == Status::OK;
        let others = message.listed().iter().skip(1);
        let views = scene.views.iter().enumerate();
        let latency = message.timing.sent_at_nanos;
        let latency = latency.checked_sub(message.stamp.captured_at_nanos);
        Self {
            kind: Self::KIND,
            at: None,
            frame: message.stamp.frame,
            seconds: scene
                .frame_rate_hz
                .map(|rate| rounded(message.stamp.frame as f64 / rate, 1e3)),
            why: (message.status != Status::OK).then(|| message.status.reason().to_owned()),
            id: person.map(|person| person.id),
            others: others.map(|other| Other::of_message(scene, other)).collect(),
            joints: places(joints, person.is_some()),
            spread: joints
                .iter()
                .map(|joint| Some(joint).filter(found).and_then(|joint| spread(joint.covariance)))
                .collect(),
            views: views.map(|(view, _)| seen(scene, message, view)).collect(),
            people: Some(message.n_seen).filter(|n_seen| *n_seen > 0),
            stature: person.and_then(stature),
            latency_ms: latency.map(|nanos| rounded(nanos as f64 / 1e6, 10.0)),
        }
    }

    /// Returns the frame as a message to the page.
    pub(crate) fn text(&self) -> String {
        // Numbers that are not finite become null; no other error is possible.
        serde_json::to_string(self).unwrap_or_default()
    }
}

impl Other {
    fn of_message(scene: &Scene, person: &SkeletonMessage) -> Self {
        let views = person.listed_views().iter();
        let pose = |fused: &FusedView| {
            let is_seen = fused.status == Status::OK;
            is_seen.then(|| in_pixels(scene, fused)).flatten()
        };
        Self {
            id: person.id,
            joints: places(person.listed_joints(), true),
            stature: stature(person),
            views: views.map(pose).collect(),
        }
    }
}

/// Returns the position of every joint in world coordinates; `None` for an unknown joint.
fn places(joints: &[Joint3d], is_somebody: bool) -> Vec<Option<[f64; 3]>> {
    let place = |joint: &Joint3d| {
        let is_known = is_somebody && joint.status == Status::OK;
        is_known.then(|| in_world(joint.in_world))
    };
    joints.iter().map(place).collect()
}

/// Returns the height of a person, in metres; `None` if unknown.
fn stature(person: &SkeletonMessage) -> Option<f64> {
    Some(rounded(person.stature_m, 1e3)).filter(|metres| *metres > 0.0)
}

/// Returns the joints in a view, in pixels; `None` for a joint whose position is unknown.
fn in_pixels(scene: &Scene, fused: &FusedView) -> Option<Vec<Option<[f64; 2]>>> {
    let n_parts = (fused.n_parts as usize).min(MAX_PARTS);
    let joints = scene.joints_of(&fused.centres_px[..n_parts])?;
    Some(joints.into_iter().map(in_view).collect())
}

fn seen(scene: &Scene, message: &Skeletons, view: usize) -> Seen {
    let views = message.followed().map(SkeletonMessage::listed_views);
    let fused = views.and_then(|views| views.get(view));
    let status = fused.map_or(Status::NO_DETECTION, |fused| fused.status);
    let Some(fused) = fused.filter(|_| status == Status::OK) else {
        let is_there = message.views_present >> view & 1 == 1;
        let why = if is_there || status != Status::NO_DETECTION {
            status.reason()
        } else {
            "no frame arrived in time"
        };
        return Seen {
            why: Some(why.to_owned()),
            ..Seen::default()
        };
    };
    Seen {
        joints: in_pixels(scene, fused),
        why: None,
        behind: scene.tells_facing && fused.exchanged == 1,
    }
}

/// Rounds a value to a multiple of 1 / `per`.
pub(crate) fn rounded(value: f64, per: f64) -> f64 {
    (value * per).round() / per
}

/// Rounds a position to a tenth of a millimetre.
pub(crate) fn in_world(point: [f64; 3]) -> [f64; 3] {
    point.map(|point| rounded(point, 1e4))
}

/// Rounds a position to a tenth of a pixel; `None` if it is unknown.
pub(crate) fn in_view(point: [f64; 2]) -> Option<[f64; 2]> {
    let is_known = point.iter().all(|side| side.is_finite());
    is_known.then(|| point.map(|side| rounded(side, 10.0)))
}

/// Rounds a covariance to a hundredth of a square millimetre; `None` if it is unknown.
pub(crate) fn spread(covariance: [f64; 6]) -> Option<[f64; 6]> {
    let is_known = covariance.iter().all(|value| value.is_finite());
    is_known.then(|| covariance.map(|covariance| rounded(covariance, 1e8)))
}

#[cfg(test)]
pub(crate) mod tests {
    use skeleton::PARSE14;

    use super::*;
    use crate::scene::View;

    /// Returns the scene of a run with one view.
    pub(crate) fn scene() -> Scene {
        Scene {
            name: "test".to_owned(),
            views: vec![View {
                name: "a".to_owned(),
                size: [640, 480],
                camera: None,
            }],
            joints: &PARSE14,
            up: [0.0, 0.0, 1.0],
            frame_rate_hz: None,
            tells_facing: true,
            problem: None,
        }
    }

    #[test]
    fn the_followed_person_is_shown_first() {
        let mut message = Box::<Skeletons>::default();
        (message.n_people, message.n_seen) = (2, 3);
        for (nth, person) in message.people[..2].iter_mut().enumerate() {
            (person.id, person.n_joints, person.n_views) = (5 - nth as u64, 14, 1);
            (person.joints[0].in_world[0], person.stature_m) = (1.0 + nth as f64, 1.7);
        }
        let moment = Moment::of_message(&scene(), &message);
        assert_eq!(moment.joints.len(), 14);
        assert_eq!(moment.joints[0], Some([1.0, 0.0, 0.0]));
        assert_eq!(
            (moment.people, moment.stature, moment.why),
            (Some(3), Some(1.7), None)
        );
        assert_eq!((moment.id, moment.others.len()), (Some(5), 1));
        let other = &moment.others[0];
        assert_eq!((other.id, other.joints[0]), (4, Some([2.0, 0.0, 0.0])));
        (message.n_people, message.status) = (0, Status::TOO_FEW_VIEWS);
        let moment = Moment::of_message(&scene(), &message);
        assert_eq!((moment.joints, moment.stature), (vec![None; 14], None));
        assert_eq!(moment.why.as_deref(), Some("too few views"));
        assert_eq!(
            moment.views[0].why.as_deref(),
            Some("no frame arrived in time")
        );
    }
}
