//! Checks whether the joints found can belong to one human body: removes impossible joints, and keeps the bones at their lengths.

use geometry::{TriangulateError, Triangulated};
use nalgebra::{Matrix3, Point3, Vector3};
use skeleton::body::{Covariances, Joints, Lengths, N_JOINTS, Reason};
use skeleton::{Joint, JointSet, PARSE14};

use crate::skeleton_settings::BodySettings;

/// Reason why a joint has no position.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoJoint {
    /// The joint cannot be triangulated.
    #[error(transparent)]
    Triangulation(#[from] TriangulateError),
    /// No human body can have the joint at the position that was found.
    #[error("no human body can have the joint at this position")]
    Implausible,
}

/// Assessment of how plausible a skeleton is as a human body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Standing height estimated from the bone lengths, in metres; `None` if too few bones are known.
    pub stature_m: Option<f64>,
    /// Root mean square deviation of the bone lengths from the mean lengths of people, in standard deviations.
    pub deviation: f64,
    /// Reason why the skeleton cannot be a person's; if set, no joint has a position.
    pub nobody: Option<Reason>,
}

/// Checks the skeletons of one person from frame to frame, and learns the person's bone lengths.
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    lengths: Lengths,
    /// Number of frames since the last one with a body.
    n_without: u32,
}

/// After this many frames without a body, the next body is assumed to be another person's.
const FORGET_AFTER: u32 = 30;

/// Correction of one of the 14 joints.
struct Change {
    is_dropped: bool,
    /// Displacement of the joint, and its new covariance.
    moved: Option<(Vector3<f64>, Matrix3<f64>)>,
}

impl Bodies {
    /// Removes joints that are impossible for a human body, and moves the others so that the bones keep their lengths.
    ///
    /// * `of_body`: the joints of `skeleton::PARSE14`.
    /// * `joints`: the joints of the skeleton's own joint set.
    pub(crate) fn settle(
        &mut self,
        settings: &BodySettings,
        of_body: &[Result<Triangulated, TriangulateError>],
        (set, joints): (&JointSet, Vec<Result<Triangulated, TriangulateError>>),
    ) -> (Vec<Result<Triangulated, NoJoint>>, Option<Body>) {
        let known = joints.into_iter().map(|joint| joint.map_err(NoJoint::from));
        let mut joints: Vec<Result<Triangulated, NoJoint>> = known.collect();
        if !settings.check || of_body.len() != N_JOINTS {
            return (joints, None);
        }
        let (places, covariances) = places(of_body);
        let verdict = skeleton::body::check(&places, &covariances, None);
        if places.iter().flatten().count() == 0 {
            self.n_without += 1;
            return (joints, None);
        }
        if verdict.nobody.is_some() {
            self.n_without += 1;
        } else {
            if self.n_without >= FORGET_AFTER {
                self.lengths.reset();
            }
            self.n_without = 0;
        }
        self.lengths.add(&places, &verdict);
        let kept = verdict.keep(&places);
        let lengths = Some(&self.lengths).filter(|_| settings.learn);
        let refined = settings.prior.then(|| skeleton::body::refine(&kept, &covariances, lengths));
        let change = |joint: usize| Change {
            is_dropped: verdict.nobody.is_some() || verdict.dropped[joint],
            moved: refined.as_ref().and_then(|refined| {
                let by = refined.joints[joint]? - kept[joint]?;
                Some((by, refined.covariances[joint]?))
            }),
        };
        let changes: [Change; N_JOINTS] = core::array::from_fn(change);
        for (joint, place) in set.joints.iter().zip(&mut joints) {
            let of_joint: Vec<&Change> = same_parts(joint).map(|part| &changes[part]).collect();
            if of_joint.iter().any(|change| change.is_dropped) {
                *place = Err(NoJoint::Implausible);
            } else if let Ok(place) = place {
                let moved: Vec<_> =
                    of_joint.iter().filter_map(|change| change.moved.as_ref()).collect();
                if !moved.is_empty() {
                    let sum: Vector3<f64> = moved.iter().map(|moved| moved.0).sum();
                    place.in_world += sum / moved.len() as f64;
                }
                if let [(_, covariance)] = moved[..] {
                    place.covariance = *covariance;
                }
            }
        }
        let body = Body {
            stature_m: verdict.stature.map(|stature| stature.metres),
            deviation: verdict.deviation,
            nobody: verdict.nobody,
        };
        (joints, Some(body))
    }
}

/// Returns the joints of `skeleton::PARSE14` that are made of the same body parts as the given joint.
fn same_parts(joint: &Joint) -> impl Iterator<Item = usize> {
    let of_body = PARSE14.joints.iter().enumerate();
    let same = of_body.filter(|(_, it)| it.parts.iter().any(|part| joint.parts.contains(part)));
    same.map(|joint| joint.0)
}

fn places(joints: &[Result<Triangulated, TriangulateError>]) -> (Joints, Covariances) {
    let found = |joint: usize| joints.get(joint)?.as_ref().ok();
    let place = |joint: usize| -> Option<Point3<f64>> { Some(found(joint)?.in_world) };
    let covariance = |joint: usize| Some(found(joint)?.covariance);
    (
        core::array::from_fn(place),
        core::array::from_fn(covariance),
    )
}
