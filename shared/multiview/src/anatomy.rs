//! Decides which side of a skeleton is the right-hand side, from the direction in which heads, knees, elbows and backs bend.
//!
//! Swapping left and right in all views at once changes no energy. Two views can show whether they agree, but not which of them sees the
//! person from behind. A labelled 3D skeleton can show it. Let `l` point from its right to its left, and `u` from its pelvis to its neck.
//! Then `l x u` points to the front if the labels are right, and to the back if they are swapped. The true front is known because bodies
//! bend forwards.

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::front::{L_HIP, L_SHOULDER, NECK, R_HIP, R_SHOULDER, front, trunk};

/// Indices of the PARSE joints that the evidence uses; this one is the right ankle.
const R_ANKLE: usize = 0;
const R_KNEE: usize = 1;
const L_KNEE: usize = 4;
const L_ANKLE: usize = 5;
const R_WRIST: usize = 6;
const R_ELBOW: usize = 7;
const L_ELBOW: usize = 10;
const L_WRIST: usize = 11;
const HEAD: usize = 13;

/// Returns the evidence that left and right of a skeleton are labelled correctly, in trunk lengths.
///
/// The evidence is the sum of these distances: the head in front of the neck, the knees in front of the line from hip to ankle, the elbows
/// behind the line from shoulder to wrist and, if the up direction is known, the neck in front of the pelvis. Swapping left and right
/// negates it exactly. The paper does not answer this question; the rule is our own.
///
/// * `joints`: the 14 joints of `skeleton::PARSE14` in the world; a missing joint contributes 0.
/// * Returns 0 if the trunk or both sides are missing.
pub fn anatomical_evidence(
    joints: &[Option<Point3<f64>>],
    up_in_world: Option<UnitVector3<f64>>,
) -> f64 {
    let at = |joint: usize| joints.get(joint).copied().flatten();
    let middle = |a: usize, b: usize| Some(nalgebra::center(&at(a)?, &at(b)?));
    let (Some(trunk), Some(front)) = (trunk(joints), front(joints)) else {
        return 0.0;
    };
    let length = trunk.norm();
    let neck = at(NECK);
    let ahead = |joint: usize, from: Option<Point3<f64>>| {
        at(joint).zip(from).map_or(0.0, |(joint, from)| (joint - from).dot(&front))
    };
    let across = |right: usize, left: usize| Some(at(left)? - at(right)?);
    let sides = [across(R_SHOULDER, L_SHOULDER), across(R_HIP, L_HIP)];
    let left: Vector3<f64> = sides.into_iter().flatten().sum();
    let lean = up_in_world
        .and_then(|up| left.cross(&up).try_normalize(1e-9))
        .map_or(0.0, |front| trunk.dot(&front));
    let sum = ahead(HEAD, neck)
        + ahead(R_KNEE, middle(R_HIP, R_ANKLE))
        + ahead(L_KNEE, middle(L_HIP, L_ANKLE))
        - ahead(R_ELBOW, middle(R_SHOULDER, R_WRIST))
        - ahead(L_ELBOW, middle(L_SHOULDER, L_WRIST))
        + lean;
    sum / length
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    use super::*;

    /// Returns a person facing +x, up +z, left +y; slightly bent knees and elbows, head in front.
    fn standing() -> Vec<Option<Point3<f64>>> {
        [
            [0.0, -0.1, 0.0],
            [0.05, -0.1, 0.45],
            [0.0, -0.1, 0.9],
            [0.0, 0.1, 0.9],
            [0.05, 0.1, 0.45],
            [0.0, 0.1, 0.0],
            [0.1, -0.25, 0.9],
            [0.0, -0.25, 1.15],
            [0.0, -0.2, 1.4],
            [0.0, 0.2, 1.4],
            [0.0, 0.25, 1.15],
            [0.1, 0.25, 0.9],
            [0.0, 0.0, 1.45],
            [0.08, 0.0, 1.7],
        ]
        .map(|point| Some(Point3::from(point)))
        .to_vec()
    }

    fn exchanged(joints: &[Option<Point3<f64>>]) -> Vec<Option<Point3<f64>>> {
        [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13]
            .map(|joint| joints[joint])
            .to_vec()
    }

    #[test]
    fn a_standing_person_is_distinguished_from_the_mirror_image() {
        assert!(anatomical_evidence(&standing(), None) > 0.2);
        assert!(anatomical_evidence(&exchanged(&standing()), None) < -0.2);
    }

    #[test]
    fn a_bent_back_gives_more_evidence_when_up_is_known() {
        let bent = |joint: Option<Point3<f64>>| {
            joint.map(|point| {
                if point.z > 1.0 {
                    Point3::new(point.z - 0.9, point.y, 0.9 + point.x)
                } else {
                    point
                }
            })
        };
        let bent: Vec<_> = standing().into_iter().map(bent).collect();
        let without = anatomical_evidence(&bent, None);
        let with = anatomical_evidence(&bent, Some(Vector3::z_axis()));
        assert!(with > without + 0.5, "{with} {without}");
    }

    #[test]
    fn without_hips_there_is_no_evidence() {
        let mut joints = standing();
        joints[R_HIP] = None;
        assert_eq!(anatomical_evidence(&joints, None), 0.0);
    }

    proptest! {
        #[test]
        fn swapping_left_and_right_negates_the_evidence(offsets in prop::collection::vec(-0.1..0.1_f64, 42)) {
            let joints: Vec<_> = standing()
                .iter()
                .zip(offsets.chunks(3))
                .map(|(joint, d)| joint.map(|point| point + Vector3::new(d[0], d[1], d[2])))
                .collect();
            let up = Some(Vector3::z_axis());
            let sum = anatomical_evidence(&joints, up) + anatomical_evidence(&exchanged(&joints), up);
            prop_assert!(sum.abs() < 1e-9, "{sum}");
        }

        #[test]
        fn moving_and_rotating_the_world_changes_nothing(yaw in -3.0..3.0_f64, x in -5.0..5.0_f64) {
            let moved = Isometry3::new(Vector3::new(x, 1.0, 0.2), Vector3::z() * yaw);
            let joints: Vec<_> = standing().iter().map(|joint| joint.map(|point| moved * point)).collect();
            let up = Some(Vector3::z_axis());
            let (here, there) = (anatomical_evidence(&standing(), up), anatomical_evidence(&joints, up));
            prop_assert!((here - there).abs() < 1e-9);
        }
    }
}
