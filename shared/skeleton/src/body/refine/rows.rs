//! Expectations about bones, written as residuals that depend on joints and stature, with their derivatives.

use nalgebra::{Point3, Vector3};

use crate::body::bone::{BONES, N_BONES, SIDES};
use crate::body::check::expected;
use crate::body::lengths::Lengths;
use crate::body::{Joints, N_JOINTS};

/// One row for every bone, then one for every pair of a left and a right bone.
pub(super) const N_ROWS: usize = N_BONES + SIDES.len();

/// Minimum standard deviation of a bone's length, in metres.
const LEAST_SPREAD: f64 = 0.015;
/// Standard deviation of the difference between the sides, in metres; our own choice.
const SIDES_SD: f64 = 0.015;

/// The unknowns of the problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// Positions of the joints, in metres in the world; 0 for a missing joint.
    pub(super) joints: [Vector3<f64>; N_JOINTS],
    /// Stature, in metres.
    pub(super) stature: f64,
}

impl State {
    /// Interpolates between this state and another.
    pub(super) fn towards(&self, target: &Self, share: f64) -> Self {
        Self {
            joints: core::array::from_fn(|i| self.joints[i].lerp(&target.joints[i], share)),
            stature: self.stature + share * (target.stature - self.stature),
        }
    }

    /// Returns the largest displacement of a joint between two states, in metres.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let pairs = self.joints.iter().zip(&other.joints);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    fn bone(&self, bone: usize) -> Vector3<f64> {
        let [a, b] = BONES[bone].from.map(|joint| Point3::from(self.joints[joint]));
        self.joints[BONES[bone].to] - nalgebra::center(&a, &b).coords
    }
}

/// One expectation for the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    of: Of,
    /// Variance of the expectation, in square metres.
    pub(super) variance: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Of {
    /// A bone has its learned length.
    Learned { bone: usize, metres: f64 },
    /// A bone has the fraction of the stature that is expected for its kind.
    Share { bone: usize },
    /// The left and the right bone are equally long.
    Sides { right: usize, left: usize },
}

/// A residual and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Linear {
    /// The residual, in metres; 0 if the expectation is met.
    pub(super) residual: f64,
    pub(super) by_joint: [Vector3<f64>; N_JOINTS],
    pub(super) by_stature: f64,
    /// Joints on which the residual depends: bit `i` is set for joint `i`.
    pub(super) mask: u32,
}

impl Row {
    /// Returns the rows whose joints are present.
    ///
    /// * `stature`: rough height of the person, in metres, which determines the spread among people.
    pub(super) fn all(
        joints: &Joints,
        stature: f64,
        lengths: Option<&Lengths>,
    ) -> [Option<Self>; N_ROWS] {
        let is_there = |bone: usize| BONES[bone].length(joints).is_some();
        let of_bone = |bone: usize| {
            let kind = BONES[bone].kind;
            let spread = expected(kind, stature, lengths).spread.max(LEAST_SPREAD);
            let learned = lengths.and_then(|length| length.of_kind(kind));
            let of = learned.map_or(Of::Share { bone }, |learned| Of::Learned {
                bone,
                metres: learned.metres,
            });
            is_there(bone).then_some(Self {
                of,
                variance: spread * spread,
            })
        };
        let of_sides = |[right, left]: [usize; 2]| {
            (is_there(right) && is_there(left)).then_some(Self {
                of: Of::Sides { right, left },
                variance: SIDES_SD * SIDES_SD,
            })
        };
        core::array::from_fn(|row| {
            let sides = row.checked_sub(N_BONES).map(|pair| SIDES[pair]);
            sides.map_or_else(|| of_bone(row), of_sides)
        })
    }

    /// Returns the residual, in metres; 0 if the expectation is met.
    pub(super) fn residual(&self, state: &State) -> f64 {
        let length = |bone: usize| state.bone(bone).norm();
        match self.of {
            Of::Learned { bone, metres } => length(bone) - metres,
            Of::Share { bone } => {
                length(bone) - BONES[bone].kind.proportion().length(state.stature)
            }
            Of::Sides { right, left } => length(right) - length(left),
        }
    }

    /// Returns the residual with its derivatives. A bone of length 0 has no direction, so its derivatives are 0.
    pub(super) fn linear(&self, state: &State) -> Linear {
        let mut it = Linear {
            residual: self.residual(state),
            by_joint: [Vector3::zeros(); N_JOINTS],
            by_stature: 0.0,
            mask: 0,
        };
        let mut add = |bone: usize, sign: f64| {
            let direction = state.bone(bone).try_normalize(1e-9);
            let direction = sign * direction.unwrap_or_default();
            it.mask |= BONES[bone].mask();
            it.by_joint[BONES[bone].to] += direction;
            for joint in BONES[bone].from {
                it.by_joint[joint] -= 0.5 * direction;
            }
        };
        match self.of {
            Of::Learned { bone, .. } => add(bone, 1.0),
            Of::Share { bone } => {
                add(bone, 1.0);
                it.by_stature = -BONES[bone].kind.proportion().length_by_stature(state.stature);
            }
            Of::Sides { right, left } => {
                add(right, 1.0);
                add(left, -1.0);
            }
        }
        it
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::testing;

    #[test]
    fn derivatives_equal_those_of_the_residual() {
        let joints = testing::noisy(
            &testing::walking(1.3),
            0.05,
            0.05,
            &mut fastrand::Rng::with_seed(3),
        );
        let state = State {
            joints: joints.map(|joint| joint.unwrap().coords),
            stature: 1.3,
        };
        let mut lengths = Lengths::default();
        for learned in [false, true] {
            let rows = Row::all(&joints, 1.3, learned.then_some(&lengths));
            for row in rows.iter().flatten() {
                let linear = row.linear(&state);
                let step = 1e-6;
                let numeric = |change: &dyn Fn(&mut State, f64)| {
                    let [ahead, behind] = [step, -step].map(|by| {
                        let mut it = state;
                        change(&mut it, by);
                        row.residual(&it)
                    });
                    (ahead - behind) / (2.0 * step)
                };
                for joint in 0..N_JOINTS {
                    for axis in 0..3 {
                        let found = numeric(&|it, by| it.joints[joint][axis] += by);
                        let expected = linear.by_joint[joint][axis];
                        assert!((found - expected).abs() < 1e-7, "{row:?} {joint} {axis}");
                    }
                }
                let found = numeric(&|it, by| it.stature += by);
                assert!((found - linear.by_stature).abs() < 1e-7, "{row:?} stature");
            }
            testing::learn(&mut lengths, &joints);
            assert_eq!(lengths.n_learned(), N_BONES);
        }
    }
}
