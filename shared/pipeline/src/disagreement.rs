//! Measures how far the joints found in the single views are from the 3D result.

use std::sync::Arc;

use geometry::Triangulated;
use multiview::ViewPlan;
use nalgebra::{Matrix3, Point2};
use skeleton::JointSet;

use crate::bodies::NoJoint;
use crate::motion::Motion;
use crate::sighting::ViewSightings;

/// Maximum median distance, in metres, between a view's joints and the result; beyond it, the view shows another person.
const SAME_PERSON_M: f64 = 0.25;
/// Maximum disagreement that is added to the covariance of a joint, in metres. It is also used if fewer than two views see the joint.
const MOST_M: f64 = 0.3;
/// Error of joints on which all views agree, in metres: the position of a joint in the body is not defined any more precisely.
const DEFINITION_M: f64 = 0.02;
/// Fraction of the covariance caused by picture noise that is kept when the disagreement is added.
const NOISE_SHARE: f64 = 0.5;

/// The views of a frame and the people found in each.
#[derive(Clone, Copy)]
pub(crate) struct FoundByViews<'a> {
    pub(crate) plans: &'a [Arc<ViewPlan>],
    pub(crate) answers: &'a [Option<ViewSightings>],
    /// For every view, true if the view contributed to the result.
    pub(crate) takes_part: &'a [bool],
    /// Minimum heat that half of a candidate's joints must have, if its view did not contribute to the result. Such a view then counts as
    /// one that sees the person elsewhere.
    pub(crate) least_heat: f64,
    pub(crate) joints: &'static JointSet,
}

/// Compares the 3D joints of a result with the poses found in the single views.
///
/// Each view is represented by its nearest candidate, with left and right either as labelled or swapped. A view that did not contribute to
/// the result is also compared if it sees a person clearly. Views that show another person are ignored if at least two other views agree.
/// The function sets the residuals of every joint and their root mean square. It also adds an error to each joint's covariance: the
/// disagreement of the two views that agree best on the joint (docs/method/three-d.md).
///
/// * `motion`: motion of the solved joints in the pictures.
pub(crate) fn measure(
    found_by: &FoundByViews<'_>,
    motion: &mut Motion,
    joints: &mut [Result<Triangulated, NoJoint>],
) {
    for it in joints.iter_mut().flatten() {
        it.residuals_px.fill(f64::NAN);
    }
    let mut disagreements_m: Vec<Vec<f64>> = vec![Vec::new(); joints.len()];
    let mut found = Vec::new();
    for view in 0..found_by.plans.len() {
        let Some(distances_px) = nearest(found_by, motion, view, joints) else {
            continue;
        };
        let metres = in_metres(&found_by.plans[view], joints, &distances_px);
        for (all, metres) in disagreements_m.iter_mut().zip(&metres) {
            all.extend(Some(*metres).filter(|value| value.is_finite()));
        }
        let is_same = median(&metres).is_some_and(|value| value < SAME_PERSON_M);
        found.push((view, is_same, distances_px));
    }
    // If no two views agree on the result, all views are used.
    let has_agreed = found.iter().filter(|view| view.1).count() >= 2;
    for (view, _, distances_px) in found.iter().filter(|view| view.1 || !has_agreed) {
        for (joint, px) in joints.iter_mut().zip(distances_px) {
            if let Ok(joint) = joint {
                joint.residuals_px[*view] = *px;
            }
        }
    }
    for (joint, disagreements_m) in joints.iter_mut().zip(&mut disagreements_m) {
        if let Ok(joint) = joint {
            joint.covariance = widened(&joint.covariance, disagreements_m);
            let known = joint.residuals_px.iter().filter(|residuals_px| residuals_px.is_finite());
            let squares: Vec<f64> = known.map(|residual| residual * residual).collect();
            if !squares.is_empty() {
                let mean = squares.iter().sum::<f64>() / squares.len() as f64;
                joint.reprojection_px = mean.sqrt();
            }
        }
    }
}

/// Returns the distances of the joints from those of the view's nearest candidate, in pixels; NaN for a joint that the view does not see.
fn nearest(
    found_by: &FoundByViews<'_>,
    motion: &mut Motion,
    view: usize,
    joints: &[Result<Triangulated, NoJoint>],
) -> Option<Vec<f64>> {
    let answer = found_by.answers.get(view)?.as_ref()?;
    let camera = found_by.plans[view].camera();
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let inside = |at: &Point2<f64>| (0.0..width).contains(&at.x) && (0.0..height).contains(&at.y);
    let projected: Vec<Option<Point2<f64>>> = joints
        .iter()
        .map(|joint| camera.project(&joint.as_ref().ok()?.in_world).filter(inside))
        .collect();
    // A picture taken at another time shows the joints elsewhere.
    let mut shown_at = |skew_s: f64| {
        let by = motion.since_instant(view, [skew_s, 0.0], projected.clone());
        let mut shown = projected.clone();
        for (at, by) in shown.iter_mut().zip(by.into_iter().flatten()) {
            *at = at.map(|at| at + by);
        }
        shown
    };
    readings(found_by, view, answer)
        .map(|(age_s, points)| {
            let shown = shown_at(answer.skew_s - age_s);
            let both = shown.iter().zip(&points);
            let distance = |(at, point): (&Option<Point2<f64>>, &[f64; 2])| {
                at.map_or(f64::NAN, |at| (at - Point2::from(*point)).norm())
            };
            both.map(distance).collect::<Vec<f64>>()
        })
        .min_by(|a, b| mean(a).total_cmp(&mean(b)))
}

/// Converts distances in a picture to metres, at the distance of the joints from the camera.
fn in_metres(
    plan: &ViewPlan,
    joints: &[Result<Triangulated, NoJoint>],
    distances_px: &[f64],
) -> Vec<f64> {
    let camera = plan.camera();
    let metres = |(joint, px): (&Result<Triangulated, NoJoint>, &f64)| {
        let joint = joint.as_ref().ok()?;
        let depth_m = (camera.camera_from_world * joint.in_world).z;
        Some(px * depth_m / camera.intrinsics.fx)
    };
    let each = joints.iter().zip(distances_px);
    each.map(|joint| metres(joint).unwrap_or(f64::NAN)).collect()
}

/// Returns the covariance of a joint, widened by the disagreement of the views.
///
/// * `disagreements_m`: distance between the joint and its position according to each view, in metres.
fn widened(covariance: &Matrix3<f64>, disagreements_m: &mut [f64]) -> Matrix3<f64> {
    disagreements_m.sort_by(f64::total_cmp);
    let second = disagreements_m
        .get(1)
        .map_or(MOST_M, |disagreements_m| disagreements_m.min(MOST_M));
    let added = second.powi(2) + DEFINITION_M.powi(2);
    covariance * NOISE_SHARE + Matrix3::from_diagonal_element(added)
}

/// Returns the median of the finite values.
fn median(values: &[f64]) -> Option<f64> {
    let known = values.iter().copied().filter(|value| value.is_finite());
    let mut known: Vec<f64> = known.collect();
    known.sort_by(f64::total_cmp);
    known.get(known.len() / 2).copied()
}

/// Returns the joints of all candidates of a view, both with left and right as labelled and with them swapped, and the time since the
/// network saw them, in seconds.
fn readings<'a>(
    found_by: &FoundByViews<'a>,
    view: usize,
    answer: &'a ViewSightings,
) -> impl Iterator<Item = (f64, Vec<[f64; 2]>)> + 'a {
    let has_part = found_by.takes_part.get(view) == Some(&true);
    let least_heat = found_by.least_heat;
    let joints = found_by.joints;
    let seen = answer.people.iter();
    let seen = seen.filter(move |sighting| has_part || sighting.is_clear(least_heat));
    let each = seen.flat_map(|sighting| [(sighting, false), (sighting, true)]);
    each.map(move |(sighting, is_exchanged)| {
        let age_s = f64::from(sighting.age_s);
        (age_s, sighting.joints_of_set(joints, is_exchanged))
    })
}

/// Returns the mean of the finite distances; infinite if there is none. A sum would favour candidates with few joints.
fn mean(distances: &[f64]) -> f64 {
    let known = distances.iter().filter(|distance| distance.is_finite());
    let (n, sum) = known.fold((0_u32, 0.0), |(n, sum), distance| (n + 1, sum + distance));
    if n == 0 {
        f64::INFINITY
    } else {
        sum / f64::from(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_covariance_grows_with_the_disagreement_of_the_two_best_views() {
        let noise = Matrix3::from_diagonal_element(1e-4);
        let sd = |disagreements: &[f64]| {
            let wide = widened(&noise, &mut disagreements.to_vec());
            wide[(0, 0)].sqrt()
        };
        let close = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-12, "{got}");
        close(sd(&[0.5, 0.0, 0.1, 0.4]), (0.5e-4 + 0.01 + 4e-4_f64).sqrt());
        let alone = (0.5e-4 + 0.09 + 4e-4_f64).sqrt();
        close(sd(&[0.01]), alone);
        close(sd(&[9.0, 8.0]), alone);
    }

    #[test]
    fn a_candidate_without_common_joints_is_not_the_nearest() {
        assert_eq!(mean(&[2.0, f64::NAN, 4.0]), 3.0);
        assert_eq!(mean(&[f64::NAN; 2]), f64::INFINITY);
    }

    #[test]
    fn the_median_ignores_missing_values() {
        assert_eq!(median(&[f64::NAN, 3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[f64::NAN]), None);
    }
}
