//! Directions that users give, and rotations of the world so that a given axis points up, for files whose readers expect this.

use nalgebra::{Matrix3, Rotation3, UnitVector3, Vector3};

/// Returns the direction of three numbers from outside; `None` if they have no length, or if it is not finite.
pub fn direction(numbers: [f64; 3]) -> Option<UnitVector3<f64>> {
    let vector = Vector3::from(numbers);
    // Finite numbers may have an infinite length; divided by it, they are all zero.
    UnitVector3::try_new(vector, 1e-9).filter(|_| vector.norm().is_finite())
}

/// Returns the smallest rotation of the world with which z points up; the identity if it already does.
///
/// * `up`: up direction (opposite to gravity) in the world.
pub fn z_up_from_world(up: &UnitVector3<f64>) -> Rotation3<f64> {
    Rotation3::rotation_between(up, &Vector3::z_axis())
        // If z points straight down, there is no unique smallest rotation, so a rotation by 180 degrees about x is used.
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI))
}

/// Returns the rotation of the world with which y points up: z up, then `(X, Y, Z) = (y, z, x)`.
///
/// * `up`: up direction (opposite to gravity) in the world.
pub fn y_up_from_world(up: &UnitVector3<f64>) -> Rotation3<f64> {
    let cyclic = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
    Rotation3::from_matrix_unchecked(cyclic * z_up_from_world(up).matrix())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_without_a_finite_length_are_no_direction() {
        assert_eq!(direction([0.0, -2.0, 0.0]), Some(-Vector3::y_axis()));
        for numbers in [
            [0.0; 3],
            [f64::NAN, 0.0, 1.0],
            [0.0, f64::INFINITY, 0.0],
            [0.0, 0.0, 1e200],
        ] {
            assert_eq!(direction(numbers), None, "{numbers:?}");
        }
    }

    #[test]
    fn any_up_direction_is_rotated_to_the_requested_axis() {
        for up in [
            [0.0, 0.0, 1.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, -1.0],
            [0.6, 0.0, 0.8],
        ] {
            let up = UnitVector3::new_normalize(Vector3::from(up));
            assert!((z_up_from_world(&up) * *up - Vector3::z()).norm() < 1e-12);
            assert!((y_up_from_world(&up) * *up - Vector3::y()).norm() < 1e-12);
            let determinant = y_up_from_world(&up).matrix().determinant();
            assert!((determinant - 1.0).abs() < 1e-12, "no mirror image");
        }
    }
}
