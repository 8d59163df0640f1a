//! The direction in which a person faces, according to a skeleton and according to every view.

use geometry::Camera;
use nalgebra::{Point3, Vector3};

/// Indices of the PARSE joints of the trunk.
pub(crate) const R_HIP: usize = 2;
pub(crate) const L_HIP: usize = 3;
pub(crate) const R_SHOULDER: usize = 8;
pub(crate) const L_SHOULDER: usize = 9;
pub(crate) const NECK: usize = 12;

/// Evidence of the picture of one view about the direction in which the person faces.
///
/// The components are `[towards the right of the picture, towards the camera]`. For a unit vector `n` with these two components, `2 e n` is
/// the logarithm of the likelihood of facing `n` over that of facing `-n`: the natural parameter of a von Mises distribution. Zeros mean no
/// evidence. Evidence of independent views adds up. Any detector can provide this evidence.
pub type FrontEvidence = [f32; 2];

/// Returns the direction in which a labelled skeleton faces, as a unit vector in the frame of its joints.
///
/// It is `l x u` with `l` from the skeleton's right to its left and `u` from its pelvis to its neck. If left and right are swapped, it is
/// the opposite direction.
///
/// * `joints`: the 14 joints of `skeleton::PARSE14`.
/// * Returns `None` without a trunk, or if both the shoulders and the hips are incomplete.
pub fn front(joints: &[Option<Point3<f64>>]) -> Option<Vector3<f64>> {
    let at = |joint: usize| joints.get(joint).copied().flatten();
    let across = |right: usize, left: usize| Some(at(left)? - at(right)?);
    let sides = [across(R_SHOULDER, L_SHOULDER), across(R_HIP, L_HIP)];
    let left: Vector3<f64> = sides.into_iter().flatten().sum();
    left.cross(&trunk(joints)?).try_normalize(1e-9)
}

/// Returns the vector from the pelvis to the neck.
pub(crate) fn trunk(joints: &[Option<Point3<f64>>]) -> Option<Vector3<f64>> {
    let at = |joint: usize| joints.get(joint).copied().flatten();
    Some(at(NECK)? - nalgebra::center(&at(R_HIP)?, &at(L_HIP)?))
}

/// Projects a direction in the world to the two components of [`FrontEvidence`], for a person at a place:
/// towards the right of the picture, and towards the camera.
///
/// The direction to the right is perpendicular to the ray from the camera to the place.
pub fn front_in_view(camera: &Camera, place: &Point3<f64>, front: &Vector3<f64>) -> [f64; 2] {
    let in_camera = camera.camera_from_world * place;
    let Some(ray) = in_camera.coords.try_normalize(1e-9) else {
        return [0.0; 2];
    };
    let right = Vector3::x() - ray * ray.x;
    let front = camera.camera_from_world.rotation * front;
    let right = right.try_normalize(1e-9).map_or(0.0, |right| right.dot(&front));
    [right, -ray.dot(&front)]
}

/// Returns the logarithm of the likelihood ratio of a direction over its opposite, given the evidence of one view, in nats.
pub fn front_log_ratio(in_view: [f64; 2], evidence: FrontEvidence) -> f64 {
    let [right, towards] = evidence.map(f64::from);
    2.0 * (right * in_view[0] + towards * in_view[1])
}

/// Returns the logarithm of the likelihood ratio of the direction in which a skeleton faces over its opposite, given the evidence of all
/// views, in nats; 0 without a trunk.
///
/// * `joints`: the same joints as for [`front`], in metres in the world.
/// * `views`: the camera and the evidence of every view.
pub fn front_log_ratio_of(
    joints: &[Option<Point3<f64>>],
    views: &[(&Camera, FrontEvidence)],
) -> f64 {
    let Some(front) = front(joints) else {
        return 0.0;
    };
    let known: Vec<Vector3<f64>> = joints.iter().flatten().map(|joint| joint.coords).collect();
    let place = Point3::from(known.iter().sum::<Vector3<f64>>() / known.len().max(1) as f64);
    let of_view = |(camera, evidence): &(&Camera, FrontEvidence)| {
        front_log_ratio(front_in_view(camera, &place, &front), *evidence)
    };
    views.iter().map(of_view).sum()
}

#[cfg(test)]
mod tests {
    use geometry::{Intrinsics, Lens, LensModel};
    use nalgebra::Isometry3;

    use super::*;

    fn camera() -> Camera {
        Camera {
            name: "c".to_owned(),
            intrinsics: Intrinsics {
                size: [640, 480],
                fx: 500.0,
                fy: 500.0,
                cx: 320.0,
                cy: 240.0,
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::identity(),
        }
    }

    #[test]
    fn a_person_who_looks_into_the_camera_faces_the_camera() {
        let place = Point3::new(0.0, 0.0, 3.0);
        let [right, towards] = front_in_view(&camera(), &place, &-Vector3::z());
        assert!(right.abs() < 1e-12 && (towards - 1.0).abs() < 1e-12);
        assert!(front_log_ratio([right, towards], [0.3, 0.5]) > 0.9);
        assert!(front_log_ratio([right, towards], [0.3, -0.5]) < -0.9);
    }

    #[test]
    fn right_means_right_in_the_picture_for_any_position_of_the_person() {
        let place = Point3::new(1.0, 0.5, 2.0);
        let camera = camera();
        let right = camera.project(&(place + Vector3::x() * 0.1)).unwrap();
        assert!(right.x > camera.project(&place).unwrap().x);
        let [across, towards] = front_in_view(&camera, &place, &Vector3::x());
        assert!(across > 0.8 && towards < 0.0, "{across} {towards}");
    }

    #[test]
    fn swapping_left_and_right_reverses_the_facing() {
        let mut joints = vec![None; 14];
        joints[R_HIP] = Some(Point3::new(0.0, -0.1, 0.9));
        joints[L_HIP] = Some(Point3::new(0.0, 0.1, 0.9));
        joints[NECK] = Some(Point3::new(0.0, 0.0, 1.4));
        assert_eq!(front(&joints), Some(Vector3::x()));
        joints.swap(R_HIP, L_HIP);
        assert_eq!(front(&joints), Some(-Vector3::x()));
        joints[NECK] = None;
        assert_eq!(front(&joints), None);
    }
}
