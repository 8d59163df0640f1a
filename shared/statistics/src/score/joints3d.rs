//! Errors of single joints in three dimensions: distances, before and after the best alignment.

use nalgebra::{Matrix3, Vector3};

use crate::score::Point;
use crate::score::pcp3d::distance;

/// Returns the distance of every joint from the truth, in the unit of the joints.
///
/// * Returns `None` if the truth is not known; infinity if the joint was not found.
pub fn joint_errors(found: &[Option<Point>], truth: &[Option<Point>]) -> Vec<Option<f64>> {
    let error = |(found, truth): (&Option<Point>, &Option<Point>)| {
        let truth = (*truth)?;
        Some(found.map_or(f64::INFINITY, |joint| distance(joint, truth)))
    };
    found.iter().zip(truth).map(error).collect()
}

/// Returns the found joints after the best alignment by rotation, translation and scale.
///
/// The alignment minimises the sum of squared distances over all rotations (no mirroring), translations and scales (Umeyama 1991), using
/// the joints that are both found and known. The remaining distances measure the error of the pose regardless of its position, orientation
/// and size. Their mean is the Procrustes form of the MPJPE.
///
/// * Returns `None` if fewer than three joints are both found and known, or the found joints are all at one place.
pub fn aligned(found: &[Option<Point>], truth: &[Option<Point>]) -> Option<Vec<Option<Point>>> {
    let both: Vec<(Vector3<f64>, Vector3<f64>)> = found
        .iter()
        .zip(truth)
        .filter_map(|(found, truth)| Some(((*found)?.into(), (*truth)?.into())))
        .collect();
    if both.len() < 3 {
        return None;
    }
    let n = both.len() as f64;
    let centre_found = both.iter().map(|pair| pair.0).sum::<Vector3<f64>>() / n;
    let centre_truth = both.iter().map(|pair| pair.1).sum::<Vector3<f64>>() / n;
    let mut covariance = Matrix3::zeros();
    let mut spread = 0.0;
    for (found, truth) in &both {
        let found = found - centre_found;
        covariance += (truth - centre_truth) * found.transpose();
        spread += found.norm_squared();
    }
    if spread == 0.0 || !spread.is_finite() {
        return None;
    }
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut flip = Vector3::new(1.0, 1.0, 1.0);
    if (u * v_t).determinant() < 0.0 {
        flip[svd.singular_values.imin()] = -1.0;
    }
    let rotation = u * Matrix3::from_diagonal(&flip) * v_t;
    let scale = svd.singular_values.dot(&flip) / spread;
    let place = |point: Point| {
        let point = rotation * (Vector3::from(point) - centre_found) * scale + centre_truth;
        point.into()
    };
    Some(found.iter().map(|point| point.map(place)).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    use super::*;

    fn points(values: &[Point]) -> Vec<Option<Point>> {
        values.iter().copied().map(Some).collect()
    }

    fn worst(found: &[Option<Point>], truth: &[Option<Point>]) -> f64 {
        let errors = joint_errors(found, truth).into_iter().flatten();
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn a_joint_that_was_not_found_has_an_infinite_error() {
        let truth = [Some([0.0; 3]), Some([0.0; 3]), None];
        let found = [Some([3.0, 4.0, 0.0]), None, Some([0.0; 3])];
        let got = joint_errors(&found, &truth);
        assert_eq!(got, [Some(5.0), Some(f64::INFINITY), None]);
    }

    #[test]
    fn a_mirrored_pose_stays_wrong() {
        let truth = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 0.0, 3.0],
        ];
        let mirrored = truth.map(|[x, y, z]| [-x, y, z]);
        let got = aligned(&points(&mirrored), &points(&truth)).unwrap();
        assert!(worst(&got, &points(&truth)) > 0.3);
    }

    #[test]
    fn two_joints_or_coincident_joints_cannot_be_aligned() {
        let two = points(&[[0.0; 3], [1.0; 3]]);
        assert_eq!(aligned(&two, &two), None);
        let one_place = points(&[[2.0; 3]; 5]);
        assert_eq!(aligned(&one_place, &one_place), None);
    }

    proptest! {
        #[test]
        fn a_moved_rotated_and_scaled_pose_is_aligned(
            truth in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 4..14),
            axis in prop::array::uniform3(-2.0..2.0_f64),
            shift in prop::array::uniform3(-5.0..5.0_f64),
            scale in 0.2..5.0_f64,
        ) {
            let truth = points(&truth);
            let turn = Rotation3::new(Vector3::from(axis));
            let place = |point: Point| (turn * Vector3::from(point) * scale + Vector3::from(shift)).into();
            let found: Vec<Option<Point>> = truth.iter().map(|truth| truth.map(place)).collect();
            let got = aligned(&found, &truth).unwrap();
            prop_assert!(worst(&got, &truth) < 1e-8);
        }

        #[test]
        fn no_slightly_different_rotation_fits_better(
            truth in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 5),
            found in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 5),
            axis in prop::array::uniform3(-0.1..0.1_f64),
            scale in 0.9..1.1_f64,
        ) {
            let (truth, found) = (points(&truth), points(&found));
            let got = aligned(&found, &truth).unwrap();
            let squares = |found: &[Option<Point>]| {
                joint_errors(found, &truth).into_iter().flatten().map(|joint_error| joint_error * joint_error).sum::<f64>()
            };
            let turn = Rotation3::new(Vector3::from(axis));
            let other = |point: Point| (turn * Vector3::from(point) * scale).into();
            let others: Vec<Option<Point>> = got.iter().map(|joint| joint.map(other)).collect();
            prop_assert!(squares(&got) <= squares(&others) + 1e-9);
        }
    }
}
