//! Alignment of one rig with another.

use geometry::Camera;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Maps points of one world to another: `scale * rotation * point + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Rotation from the first world to the second.
    pub rotation: UnitQuaternion<f64>,
    /// Factor by which lengths are multiplied.
    pub scale: f64,
    /// Translation, applied last, in units of the target world.
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// Returns a point in the target world.
    pub fn point(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * (self.scale * point.coords) + self.translation)
    }

    /// Returns a camera in the target world.
    pub fn camera(&self, camera: &Camera) -> Camera {
        let centre = self.point(&camera.centre_in_world());
        let rotation = camera.camera_from_world.rotation * self.rotation.inverse();
        let translation = Translation3::from(rotation * -centre.coords);
        Camera {
            camera_from_world: Isometry3::from_parts(translation, rotation),
            ..camera.clone()
        }
    }
}

/// Difference between two poses of one camera, one from each of two rigs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Angle between the two rotations, radians.
    pub turn: f64,
    /// Distance between the two camera centres, in units of the second rig.
    pub way: f64,
}

/// Returns the similarity that aligns the first rig with the second. Its rotation is the mean over all cameras; the scale (if
/// `with_scale`) and the translation follow from the camera centres.
///
/// The result is also well defined for two cameras. Both rigs must have the same cameras in the same order. Returns `None` if there
/// is no camera.
pub fn aligned(from: &[Camera], to: &[Camera], with_scale: bool) -> Option<Similarity> {
    let n = from.len().min(to.len()) as f64;
    let mut sum = Matrix3::zeros();
    for (a, b) in from.iter().zip(to) {
        let turn = b.camera_from_world.rotation.inverse() * a.camera_from_world.rotation;
        sum += turn.to_rotation_matrix().matrix();
    }
    let svd = sum.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let matrix = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let middle = |cameras: &[Camera]| {
        let sum: Vector3<f64> = cameras.iter().map(|camera| camera.centre_in_world().coords).sum();
        sum / n
    };
    let [of_from, of_to] = [middle(from), middle(to)];
    let (mut across, mut own) = (0.0, 0.0);
    for (a, b) in from.iter().zip(to) {
        let a = rotation * (a.centre_in_world().coords - of_from);
        across += a.dot(&(b.centre_in_world().coords - of_to));
        own += a.norm_squared();
    }
    let scale = if with_scale && own > 0.0 && across > 0.0 {
        across / own
    } else {
        1.0
    };
    (n > 0.0).then(|| Similarity {
        rotation,
        scale,
        translation: of_to - rotation * (scale * of_from),
    })
}

/// Returns the difference between the rigs in every camera, after aligning the first rig with the second.
pub fn differences(from: &[Camera], to: &[Camera], with_scale: bool) -> Vec<Difference> {
    let Some(similarity) = aligned(from, to, with_scale) else {
        return Vec::new();
    };
    let each = from.iter().zip(to).map(|(a, b)| {
        let a = similarity.camera(a);
        Difference {
            turn: a.camera_from_world.rotation.angle_to(&b.camera_from_world.rotation),
            way: (a.centre_in_world() - b.centre_in_world()).norm(),
        }
    });
    each.collect()
}
