//! Scores of the result of one version on one frame.

use geometry::Camera;
use nalgebra::Point3;
use skeleton::SIDES;
use statistics::score::{Point, aligned, joint_errors, segment_errors, segments};
use training::datasets::sequences::{Frame, Sequence};

use crate::evaluation::{FrameResult, parse14};

/// Errors of one version on one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameScore {
    /// Errors of the twelve segments, as fractions of their lengths ([`segment_errors`]).
    pub segments: Vec<Option<f64>>,
    /// Errors of the joints, in metres; infinite for a joint that was not found.
    pub joints_m: Vec<Option<f64>>,
    /// Errors of the joints after the best alignment, in metres; empty if there is no alignment.
    pub aligned_m: Vec<Option<f64>>,
    /// True if the body fits the truth better with left and right swapped; `None` if there are no joints to compare.
    pub is_exchanged: Option<bool>,
    /// For each view, the 14 joints that were found (if any) and the true joints, in pixels of the footage. `None` if a true joint is
    /// unknown or behind the camera.
    pub views: Vec<Option<(Option<Joints>, Joints)>>,
    /// Number of single-view solutions for each pair of views (or for all views at once).
    pub iterations: Vec<u32>,
    /// Number of pairs of views (or of solutions of all views at once) that did not converge.
    pub unsettled: u32,
    /// Total number of single-view solutions.
    pub solutions: u32,
    /// Fraction of the consistency terms that were switched on.
    pub on: Option<f64>,
}

/// The joints of `skeleton::PARSE14` in an image, in pixels.
pub type Joints = [[f64; 2]; 14];

/// Compares a result with the truth.
///
/// * `frame`: the solved frame of the sequence.
pub fn score(sequence: &Sequence, frame: &Frame, found: &FrameResult) -> FrameScore {
    let truth = &frame.joints;
    let segments = segments(sequence.joints).map_or_else(Vec::new, Vec::from);
    let aligned_m = aligned(&found.joints, truth);
    let aligned_m = aligned_m.map(|aligned_m| joint_errors(&aligned_m, truth));
    let in_space = parse14(sequence.joints, truth);
    let views = sequence.rig.cameras().iter().zip(&sequence.views);
    let views = views.enumerate().map(|(nth, (camera, view))| {
        let offset = view.source_offset_px.unwrap_or_default().map(f64::from);
        let truth = projected(camera, offset, &in_space)?;
        let found = found.views.get(nth).and_then(Option::as_ref);
        let found = found.and_then(|joints| Joints::try_from(joints.as_slice()).ok());
        Some((found, truth))
    });
    FrameScore {
        segments: segment_errors(&segments, &found.joints, truth),
        joints_m: joint_errors(&found.joints, truth),
        aligned_m: aligned_m.unwrap_or_default(),
        is_exchanged: is_exchanged(&parse14(sequence.joints, &found.joints), &in_space),
        views: views.collect(),
        iterations: found.iterations.clone(),
        unsettled: found.unsettled,
        solutions: found.solutions,
        on: found.on,
    }
}

/// Returns true if swapping left and right makes the sum of the distances from the true joints smaller.
///
/// * `found`, `truth`: joints of `skeleton::PARSE14`, in metres.
/// * Returns `None` if no pair of left and right joints is both found and known.
fn is_exchanged(found: &[Option<Point>], truth: &[Option<Point>]) -> Option<bool> {
    let distance = |a: Point, b: Point| (Point3::from(a) - Point3::from(b)).norm();
    let (mut n, mut as_named, mut exchanged) = (0, 0.0, 0.0);
    for [right, left] in SIDES {
        let of = |joints: &[Option<Point>]| Some([(*joints.get(right)?)?, (*joints.get(left)?)?]);
        if let (Some(found), Some(truth)) = (of(found), of(truth)) {
            n += 1;
            as_named += distance(found[0], truth[0]) + distance(found[1], truth[1]);
            exchanged += distance(found[0], truth[1]) + distance(found[1], truth[0]);
        }
    }
    (n > 0).then_some(exchanged < as_named)
}

/// Returns the true joints in an image; `None` if a joint is unknown or behind the camera.
///
/// * `offset`: calibrated pixel at the image's top-left pixel.
/// * `joints`: joints of `skeleton::PARSE14`, in metres.
pub fn projected(camera: &Camera, offset: [f64; 2], joints: &[Option<Point>]) -> Option<Joints> {
    let mut pixels = [[0.0; 2]; 14];
    for (pixel, joint) in pixels.iter_mut().zip(joints) {
        let at = camera.project(&Point3::from((*joint)?))?;
        *pixel = [at.x - offset[0], at.y - offset[1]];
    }
    Some(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_with_swapped_sides_is_detected() {
        let truth: Vec<Option<Point>> = (0..14).map(|i| Some([f64::from(i), 0.0, 1.0])).collect();
        let mut found = truth.clone();
        assert_eq!(is_exchanged(&found, &truth), Some(false));
        for [right, left] in [[0, 5], [1, 4], [2, 3], [6, 11], [7, 10], [8, 9]] {
            found.swap(right, left);
        }
        assert_eq!(is_exchanged(&found, &truth), Some(true));
        assert_eq!(is_exchanged(&[None; 14], &truth), None);
    }
}
