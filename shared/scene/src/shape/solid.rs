//! Two kinds of smooth solids, and the distance of a point from them.

use nalgebra::{Isometry3, Point3, Vector3};

/// A smooth solid.
#[derive(Debug, Clone, Copy)]
pub(super) enum Solid {
    /// The convex hull of two balls.
    Cone {
        ends: [Point3<f32>; 2],
        radii: [f32; 2],
    },
    /// An ellipsoid along the axes of its frame.
    Ellipsoid {
        frame: Isometry3<f32>,
        radii: Vector3<f32>,
    },
}

impl Solid {
    pub(super) fn cone(from: [f32; 3], to: [f32; 3], radii: [f32; 2]) -> Self {
        Self::Cone {
            ends: [from.into(), to.into()],
            radii,
        }
    }

    pub(super) fn ellipsoid(centre: [f32; 3], radii: [f32; 3]) -> Self {
        Self::Ellipsoid {
            frame: Isometry3::translation(centre[0], centre[1], centre[2]),
            radii: radii.into(),
        }
    }

    /// Returns the solid enlarged by a distance in all directions.
    pub(super) fn thicker(self, by: f32) -> Self {
        match self {
            Self::Cone { ends, radii } => Self::Cone {
                ends,
                radii: radii.map(|radius| radius + by),
            },
            Self::Ellipsoid { frame, radii } => Self::Ellipsoid {
                frame,
                radii: radii.add_scalar(by),
            },
        }
    }

    pub(super) fn moved(self, by: &Isometry3<f32>) -> Self {
        match self {
            Self::Cone { ends, radii } => Self::Cone {
                ends: ends.map(|end| by * end),
                radii,
            },
            Self::Ellipsoid { frame, radii } => Self::Ellipsoid {
                frame: by * frame,
                radii,
            },
        }
    }

    /// Returns a box that contains the solid.
    pub(super) fn bounds(&self) -> [Vector3<f32>; 2] {
        match self {
            Self::Cone {
                ends: [a, b],
                radii,
            } => [
                a.coords.add_scalar(-radii[0]).inf(&b.coords.add_scalar(-radii[1])),
                a.coords.add_scalar(radii[0]).sup(&b.coords.add_scalar(radii[1])),
            ],
            Self::Ellipsoid { frame, radii } => {
                let turn = frame.rotation.to_rotation_matrix();
                let reach = Vector3::from_fn(|row, _| {
                    turn.matrix().row(row).transpose().component_mul(radii).norm()
                });
                let centre = frame.translation.vector;
                [centre - reach, centre + reach]
            }
        }
    }

    /// Returns true if a point is certainly farther away than `limit`, judged by a bounding ball.
    pub(super) fn is_far(&self, at: &Point3<f32>, limit: f32) -> bool {
        let (centre, radius) = match self {
            Self::Cone {
                ends: [a, b],
                radii,
            } => {
                let half = 0.5 * (b - a).norm();
                (nalgebra::center(a, b), half + radii[0].max(radii[1]))
            }
            Self::Ellipsoid { frame, radii } => (frame.translation.vector.into(), radii.max()),
        };
        (at - centre).norm_squared() > (radius + limit).powi(2)
    }

    /// Signed distance; exact for cones (Quilez, "round cone"), first-order for ellipsoids.
    pub(super) fn distance(&self, at: &Point3<f32>) -> f32 {
        match self {
            Self::Cone {
                ends: [a, b],
                radii,
            } => cone(&(at - a), &(b - a), *radii),
            Self::Ellipsoid { frame, radii } => {
                let p = frame.inverse_transform_point(at).coords;
                let near = p.component_div(radii);
                let steep = near.component_div(radii).norm();
                let size = near.norm();
                if steep < 1e-6 {
                    -radii.min()
                } else {
                    size * (size - 1.0) / steep
                }
            }
        }
    }
}

fn cone(p: &Vector3<f32>, axis: &Vector3<f32>, [first, second]: [f32; 2]) -> f32 {
    let length2 = axis.norm_squared();
    let taper = first - second;
    let flat2 = length2 - taper * taper;
    if flat2 <= 0.0 {
        // If one ball contains the other, the solid is a ball.
        return (p.norm() - first).min((p - axis).norm() - second);
    }
    let y = p.dot(axis);
    let z = y - length2;
    let x2 = (p * length2 - axis * y).norm_squared();
    let (y2, z2) = (y * y * length2, z * z * length2);
    let side = taper.signum() * taper * taper * x2;
    if z.signum() * flat2 * z2 > side {
        (x2 + z2).sqrt() / length2 - second
    } else if y.signum() * flat2 * y2 < side {
        (x2 + y2).sqrt() / length2 - first
    } else {
        ((x2 * flat2 / length2).sqrt() + y * taper) / length2 - first
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Compares with a brute-force computation, in which a cone is the union of the balls between its ends (up to an error from the
        /// finite number of balls).
        #[test]
        fn a_cone_equals_the_union_of_its_balls(
            x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..2.0,
            first in 0.1_f32..0.4, second in 0.1_f32..0.4,
        ) {
            let at = Point3::new(x, y, z);
            let solid = Solid::cone([0.0; 3], [0.0, 0.0, 1.0], [first, second]);
            let ball = |k: i32| {
                let t = k as f32 / 400.0;
                (at - Point3::new(0.0, 0.0, t)).norm() - (first + (second - first) * t)
            };
            let brute = (0..=400).map(ball).fold(f32::MAX, f32::min);
            prop_assert!((solid.distance(&at) - brute).abs() < 5e-3);
        }

        #[test]
        fn points_inside_a_solid_are_in_its_bounds_and_in_a_thicker_solid(
            x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0,
            turn in prop::array::uniform3(-3.0_f32..3.0),
        ) {
            let at = Point3::new(x, y, z);
            let placed = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), turn.into());
            for solid in [
                Solid::ellipsoid([0.1, 0.0, 0.2], [0.3, 0.15, 0.4]).moved(&placed),
                Solid::cone([0.0; 3], [0.2, 0.3, -0.3], [0.2, 0.05]).moved(&placed),
            ] {
                let [low, high] = solid.bounds();
                if solid.distance(&at) < 0.0 {
                    prop_assert!((0..3).all(|i| low[i] <= at[i] && at[i] <= high[i]));
                    prop_assert!(!solid.is_far(&at, 0.0));
                }
                let is_inside = solid.distance(&at) < 0.0;
                prop_assert!(!is_inside || solid.thicker(0.05).distance(&at) < 0.0);
            }
        }
    }
}
