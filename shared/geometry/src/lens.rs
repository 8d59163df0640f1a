//! Lens distortion: the models, their derivatives and their inverses.

use nalgebra::{Matrix2, Point2, Vector2};

mod inverse;
mod limit;

/// Distortion model of a lens, in the notation of `OpenCV`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LensModel {
    /// No distortion.
    #[default]
    Pinhole,
    /// Rational radial and tangential distortion of the normalised point (x, y), with r² = x² + y²: `x (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 +
    /// k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²)`. The formula for y is the same with x and y, and p1 and p2, swapped. `OpenCV`
    /// lists the coefficients as k1 k2 p1 p2 k3 k4 k5 k6.
    BrownConrady {
        /// Radial coefficients k1 to k6; k4 to k6 are in the denominator.
        k: [f64; 6],
        /// Tangential coefficients p1 and p2.
        p: [f64; 2],
    },
    /// Fisheye: the angle θ to the axis becomes the radius
    /// `θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)` (Kannala & Brandt 2006; `cv::fisheye`).
    KannalaBrandt {
        /// Coefficients k1 to k4.
        k: [f64; 4],
    },
}

impl std::fmt::Display for LensModel {
    /// Writes the name of the model, and the coefficients that are not 0.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let listed = |name: &str, values: &[f64]| {
            let nonzero = values.iter().enumerate().filter(|(_, value)| **value != 0.0);
            let parts: Vec<String> =
                nonzero.map(|(index, value)| format!(", {name}{} {value}", index + 1)).collect();
            parts.concat()
        };
        match self {
            Self::Pinhole => write!(out, "pinhole, no distortion"),
            Self::BrownConrady { k, p } => {
                write!(out, "Brown-Conrady{}{}", listed("k", k), listed("p", p))
            }
            Self::KannalaBrandt { k } => write!(out, "fisheye (Kannala-Brandt){}", listed("k", k)),
        }
    }
}

/// A lens: its model, and the part of the image in which the model can be inverted.
///
/// Distortion polynomials stop being monotonic at some radius outside the image they were fitted to. A [`Lens`] gives no image for rays
/// beyond the first such radius, or more than 87 degrees off the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    model: LensModel,
    max_radius: f64,
}

impl Default for Lens {
    fn default() -> Self {
        Self::new(LensModel::Pinhole)
    }
}

impl From<LensModel> for Lens {
    fn from(model: LensModel) -> Self {
        Self::new(model)
    }
}

impl Lens {
    /// Creates a lens and finds the valid range of `model`. This takes microseconds, so it should be done once per camera.
    pub fn new(model: LensModel) -> Self {
        Self {
            model,
            max_radius: limit::max_radius(&model),
        }
    }

    /// Returns the model and its coefficients.
    pub fn model(&self) -> &LensModel {
        &self.model
    }

    /// Returns the largest distance from the axis that the lens accepts, in undistorted normalised coordinates.
    pub fn max_radius(&self) -> f64 {
        self.max_radius
    }

    /// Returns the distorted position of the normalised point (x / z, y / z), in normalised coordinates.
    ///
    /// Returns `None` outside the valid range of the model.
    pub fn distort(&self, point: &Point2<f64>) -> Option<Point2<f64>> {
        self.distort_with_jacobian(point).map(|(distorted, _)| distorted)
    }

    /// Works like [`distort`](Self::distort), and also returns the derivative (row = output, column = input).
    pub fn distort_with_jacobian(
        &self,
        point: &Point2<f64>,
    ) -> Option<(Point2<f64>, Matrix2<f64>)> {
        // The range check also fails for NaN.
        if !(0.0..=self.max_radius).contains(&point.coords.norm()) {
            return None;
        }
        let (distorted, jacobian) = self.model.distort(point.coords);
        (jacobian.determinant() > 0.0).then_some((distorted.into(), jacobian))
    }

    /// Returns the normalised point whose distorted position is `distorted`; the inverse of [`distort`](Self::distort).
    ///
    /// Returns `None` if no ray of the valid range has this position, or if the iteration does not converge.
    pub fn undistort(&self, distorted: &Point2<f64>) -> Option<Point2<f64>> {
        inverse::undistort(self, distorted)
    }
}

impl LensModel {
    /// Returns true if the model has no distortion.
    pub fn is_pinhole(&self) -> bool {
        match self {
            Self::Pinhole => true,
            Self::BrownConrady { k, p } => k.iter().chain(p).all(|&c| c == 0.0),
            Self::KannalaBrandt { .. } => false,
        }
    }

    /// Returns the coefficients of the model, radial before tangential; none for a pinhole.
    pub fn coefficients(&self) -> impl Iterator<Item = f64> + '_ {
        let (k, p): (&[f64], &[f64]) = match self {
            Self::Pinhole => (&[], &[]),
            Self::BrownConrady { k, p } => (k, p),
            Self::KannalaBrandt { k } => (k, &[]),
        };
        k.iter().chain(p).copied()
    }

    /// Returns the model for a camera that is rotated about its axis: coordinates rotate by `angle`.
    ///
    /// Radial terms do not change. (p2, p1) is a vector in the image and rotates with it.
    #[must_use]
    pub fn rotated(self, angle: f64) -> Self {
        match self {
            Self::BrownConrady { k, p } => {
                let (sin, cos) = angle.sin_cos();
                let turned = [cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]];
                Self::BrownConrady { k, p: turned }
            }
            other => other,
        }
    }

    /// Returns the derivative of the distorted point with respect to a coefficient, numbered as in [`coefficients`](Self::coefficients).
    pub(crate) fn by_coefficient(&self, v: &Vector2<f64>, nth: usize) -> Vector2<f64> {
        let s = v.norm_squared();
        let power = |nth: usize| s.powi(nth as i32 + 1);
        match self {
            Self::Pinhole => Vector2::zeros(),
            Self::BrownConrady { k, .. } => {
                let (factor, _) = rational(k, s);
                let under = 1.0 + s * (k[3] + s * (k[4] + s * k[5]));
                match nth {
                    0..3 => v * (power(nth) / under),
                    3..6 => v * (-factor * power(nth - 3) / under),
                    6 => Vector2::new(2.0 * v.x * v.y, s + 2.0 * v.y * v.y),
                    _ => Vector2::new(s + 2.0 * v.x * v.x, 2.0 * v.x * v.y),
                }
            }
            Self::KannalaBrandt { .. } => {
                let r = s.sqrt();
                if r < 1e-12 {
                    return Vector2::zeros();
                }
                v * (r.atan().powi(2 * nth as i32 + 3) / r)
            }
        }
    }

    /// Returns the distorted radius of a ray with undistorted radius `r`, without tangential terms, and its derivative.
    fn radius(&self, r: f64) -> (f64, f64) {
        match self {
            Self::Pinhole => (r, 1.0),
            Self::BrownConrady { k, .. } => {
                let (factor, slope) = rational(k, r * r);
                (r * factor, factor + 2.0 * r * r * slope)
            }
            Self::KannalaBrandt { k } => {
                let angle = r.atan();
                let (distorted, slope) = fisheye(k, angle);
                (distorted, slope / (1.0 + r * r))
            }
        }
    }

    /// Returns the distorted point and its derivative, without a check of the valid range.
    fn distort(&self, v: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        match self {
            Self::Pinhole => (v, Matrix2::identity()),
            Self::BrownConrady { k, p } => {
                let (x, y) = (v.x, v.y);
                let (factor, slope) = rational(k, v.norm_squared());
                let q = Vector2::new(p[1], p[0]);
                let along = q.dot(&v);
                let distorted = v * (factor + 2.0 * along) + q * v.norm_squared();
                let cross = 2.0 * (q.x * y + q.y * x);
                let jacobian = Matrix2::new(
                    factor + 2.0 * slope * x * x + 6.0 * q.x * x + 2.0 * q.y * y,
                    2.0 * slope * x * y + cross,
                    2.0 * slope * x * y + cross,
                    factor + 2.0 * slope * y * y + 6.0 * q.y * y + 2.0 * q.x * x,
                );
                (distorted, jacobian)
            }
            Self::KannalaBrandt { .. } => {
                let r = v.norm();
                if r < 1e-12 {
                    return (v, Matrix2::identity());
                }
                let (distorted, slope) = self.radius(r);
                let unit = v / r;
                let outer = unit * unit.transpose();
                let jacobian = outer * slope + (Matrix2::identity() - outer) * (distorted / r);
                (unit * distorted, jacobian)
            }
        }
    }
}

/// Returns the rational radial factor at `s` = r², and its derivative with respect to s.
fn rational(k: &[f64; 6], s: f64) -> (f64, f64) {
    let over = 1.0 + s * (k[0] + s * (k[1] + s * k[2]));
    let under = 1.0 + s * (k[3] + s * (k[4] + s * k[5]));
    let d_over = k[0] + s * (2.0 * k[1] + s * 3.0 * k[2]);
    let d_under = k[3] + s * (2.0 * k[4] + s * 3.0 * k[5]);
    let factor = over / under;
    (factor, (d_over - factor * d_under) / under)
}

/// Returns the fisheye radius at an angle, and its derivative with respect to the angle.
fn fisheye(k: &[f64; 4], angle: f64) -> (f64, f64) {
    let s = angle * angle;
    let factor = 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])));
    let slope = 1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])));
    (angle * factor, slope)
}

#[cfg(test)]
mod tests;
