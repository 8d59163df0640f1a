//! Deviation from the epipolar constraint of a joint that two cameras see.

use geometry::Camera;
use geometry::epipolar::fundamental;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Expected error of a joint in a picture, as a fraction of the size of the person: 4 pixels for a person 400 pixels high.
pub(crate) const NOISE: f64 = 0.01;

/// The epipolar geometry of two cameras.
#[derive(Debug, Clone)]
pub(crate) struct Epipolar {
    /// Map from ideal pixels of the first camera to lines of the second.
    b_from_a: Matrix3<f64>,
}

/// A residual, with its scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Value, in expected errors of the joints.
    pub(crate) value: f64,
    /// Number of ideal pixels per expected error.
    pub(crate) px: f64,
}

impl Epipolar {
    /// Returns the epipolar geometry; `None` for cameras in one place, which have no epipolar constraint.
    pub(crate) fn new(a: &Camera, b: &Camera) -> Option<Self> {
        let b_from_a = fundamental(a, b);
        (b_from_a.norm() > 0.0).then_some(Self { b_from_a })
    }

    /// Returns the Sampson residual, in units of its expected error from the errors of both positions.
    ///
    /// * `sizes`: sizes of the person in both cameras, in ideal pixels.
    pub(crate) fn residual(&self, a: [f64; 2], b: [f64; 2], sizes: [f64; 2]) -> Option<Residual> {
        let (a, b) = (Vector3::new(a[0], a[1], 1.0), Vector3::new(b[0], b[1], 1.0));
        let in_b = self.b_from_a * a;
        let in_a = self.b_from_a.tr_mul(&b);
        let by_b = Vector2::new(in_b.x, in_b.y);
        let by_a = Vector2::new(in_a.x, in_a.y);
        let [of_a, of_b] = sizes.map(|size| NOISE * size);
        let sigma =
            (of_b.powi(2) * by_b.norm_squared() + of_a.powi(2) * by_a.norm_squared()).sqrt();
        let gradient = by_a.norm().hypot(by_b.norm());
        let value = b.dot(&in_b) / sigma;
        value.is_finite().then_some(Residual {
            value,
            px: sigma / gradient,
        })
    }
}

/// Returns the robust cost of a residual.
pub(crate) fn cost(residual: f64) -> f64 {
    (residual * residual).ln_1p()
}
