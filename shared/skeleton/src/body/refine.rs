//! Moves joints so that bones keep their lengths: a soft prior in triangulation.

mod rows;

use nalgebra::{Cholesky, Const, Matrix3, Point3, SMatrix, SVector, Vector3};

use crate::body::bone::{clean, joints_of};
use crate::body::lengths::Lengths;
use crate::body::stature::{STATURES, stature};
use crate::body::{Covariances, Joints, N_JOINTS};

use rows::{Linear, N_ROWS, Row, State};

/// Standard deviation of a joint without a covariance in every direction, in metres; our own choice.
const UNKNOWN_SD: f64 = 0.05;
/// Minimum variance, added to every covariance, in square metres: 1 mm squared.
const LEAST_VARIANCE: f64 = 1e-6;
/// Variance of the stature around its initial value from the bones, in square metres; it is so large that it has no effect.
const STATURE_VARIANCE: f64 = 0.25;
/// Stature assumed for a skeleton whose stature is unknown, in metres.
const ANY_STATURE: f64 = 1.65;
/// Number of standard deviations, including the uncertainty of its joints, beyond which a bone no longer pulls its joints.
const LOSS: f64 = 3.5;
const MAX_ITERATIONS: usize = 10;
/// The iteration ends if no joint moves by more than this, in metres.
const STILL: f64 = 1e-4;

/// A skeleton refined with the prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refined {
    /// The joints, in metres in the world; missing joints stay missing.
    pub joints: Joints,
    /// Covariances of the joints, in square metres; no direction is less certain than before. `None` for a missing joint.
    pub covariances: Covariances,
    /// Number of iterations; 0 if the joints are unchanged.
    pub iterations: usize,
}

/// Moves joints so that bones get their expected lengths, in proportion to the uncertainty of the joints.
///
/// Minimises the squared Mahalanobis distances of the joints from their triangulated positions. For every bone, it adds `ρ(((|a - b| -
/// expected) / spread)²)`. The expected length is the learned length. Its spread covers the remaining uncertainty and the effect of
/// posture, and is at least 1.5 cm. If no length was learned, the expected length follows from the stature, with the spread among people;
/// the stature is then estimated together with the joints. Left and right bones are expected to be equal, with a standard deviation of 1.5
/// cm. The loss `ρ(s) = s / (1 + s / c²)` reduces the effect of a bone whose length is not explained by its spread or by the covariances of
/// its joints, so that it does not drag its neighbours.
///
/// The method is Gauss-Newton with step halving. The normal equations are solved in the space of the bones, with 19 rows for up to 42
/// coordinates. The covariances of the result are blocks of the inverse of the normal matrix. They are only as good as the given
/// covariances; if these are too small, the joints hardly move.
///
/// * `covariances`: for a joint without a positive definite covariance, a standard deviation of 5 cm is assumed.
/// * Returns the joints unchanged, with the covariances that were used, if there is no bone or the numbers
///   diverge.
pub fn refine(joints: &Joints, covariances: &Covariances, lengths: Option<&Lengths>) -> Refined {
    let joints = clean(joints);
    let problem = Problem::new(&joints, covariances, lengths);
    let mut best = problem.measured;
    let mut cost = problem.cost(&best);
    let mut iterations = 0;
    while iterations < MAX_ITERATIONS {
        let Some(target) = problem.target(&best) else {
            return problem.unchanged();
        };
        let steps = [1.0, 0.5, 0.25, 0.125].map(|share| best.towards(&target, share));
        let Some((next, next_cost)) =
            steps.iter().map(|next| (next, problem.cost(next))).find(|step| step.1 < cost)
        else {
            break;
        };
        let moved = best.distance(next);
        (best, cost) = (*next, next_cost);
        iterations += 1;
        if moved < STILL {
            break;
        }
    }
    problem.result(&best, iterations).unwrap_or_else(|| problem.unchanged())
}

type Normal = Cholesky<f64, Const<N_ROWS>>;

/// The rows linearised at a state, in the space of the bones.
struct About {
    linear: [Option<Linear>; N_ROWS],
    /// Product of covariance and derivatives: how the joints respond to a row.
    follow: [[Vector3<f64>; N_JOINTS]; N_ROWS],
    /// Factorisation of `J C Jᵀ + variances`.
    normal: Normal,
}

struct Problem {
    present: [bool; N_JOINTS],
    measured: State,
    covariances: [Matrix3<f64>; N_JOINTS],
    /// The inverses of the covariances.
    weights: [Matrix3<f64>; N_JOINTS],
    rows: [Option<Row>; N_ROWS],
    /// Squared residual above which a row loses its effect, in square metres.
    losses: [f64; N_ROWS],
}

impl Problem {
    fn new(joints: &Joints, covariances: &Covariances, lengths: Option<&Lengths>) -> Self {
        let [low, high] = STATURES;
        let stature =
            stature(joints).map_or(ANY_STATURE, |stature| stature.metres.clamp(low, high));
        let measured = State {
            joints: joints.map(|joint| joint.map_or(Vector3::zeros(), |joint| joint.coords)),
            stature,
        };
        let usable = covariances.map(usable);
        let covariances = usable.map(|usable| usable[0]);
        let rows = Row::all(joints, stature, lengths);
        let loss = |row: Option<Row>| {
            row.map_or(1.0, |row| {
                let linear = row.linear(&measured);
                let own = |joint: usize| {
                    let by = linear.by_joint[joint];
                    by.dot(&(covariances[joint] * by))
                };
                let own: f64 = joints_of(linear.mask).map(own).sum();
                LOSS * LOSS * (row.variance + own)
            })
        };
        Self {
            present: joints.map(|joint| joint.is_some()),
            measured,
            covariances,
            weights: usable.map(|usable| usable[1]),
            rows,
            losses: rows.map(loss),
        }
    }

    /// Returns the cost to be minimised.
    fn cost(&self, state: &State) -> f64 {
        let off = (state.stature - self.measured.stature).powi(2) / STATURE_VARIANCE;
        let joints = state.joints.iter().zip(&self.measured.joints);
        let joints = joints.zip(&self.weights).map(|((at, from), weight)| {
            let off = at - from;
            off.dot(&(weight * off))
        });
        let rows = self.rows.iter().zip(&self.losses);
        let rows = rows.filter_map(|(row, loss)| {
            let row = row.as_ref()?;
            let squared = row.residual(state).powi(2);
            Some(loss * squared / (loss + squared) / row.variance)
        });
        off + joints.sum::<f64>() + rows.sum::<f64>()
    }

    /// Returns the normal equations at a state; `None` if they cannot be solved.
    fn about(&self, state: &State) -> Option<About> {
        let rows = self.rows.map(|row| row.map(|row| row.linear(state)));
        let follow = rows.map(|row| {
            let mut follow = [Vector3::zeros(); N_JOINTS];
            if let Some(row) = row {
                for joint in joints_of(row.mask) {
                    follow[joint] = self.covariances[joint] * row.by_joint[joint];
                }
            }
            follow
        });
        let mut normal = SMatrix::<f64, N_ROWS, N_ROWS>::identity();
        for (a, row) in rows.iter().enumerate() {
            let (Some(row), Some(expected)) = (row, &self.rows[a]) else {
                continue;
            };
            for b in 0..=a {
                let Some(other) = &rows[b] else { continue };
                let both = joints_of(row.mask & other.mask);
                let joints: f64 = both.map(|i| row.by_joint[i].dot(&follow[b][i])).sum();
                let stature = row.by_stature * other.by_stature * STATURE_VARIANCE;
                normal[(a, b)] = joints + stature;
                normal[(b, a)] = joints + stature;
            }
            // The weight of the loss is 1 / (1 + r² / loss)².
            let outlying = 1.0 + row.residual.powi(2) / self.losses[a];
            normal[(a, a)] += expected.variance * outlying * outlying;
        }
        let normal = normal.cholesky()?;
        Some(About {
            linear: rows,
            follow,
            normal,
        })
    }

    /// Returns the minimum of the problem linearised at a state.
    fn target(&self, state: &State) -> Option<State> {
        let about = self.about(state)?;
        let mut gaps = SVector::<f64, N_ROWS>::zeros();
        for (gap, row) in gaps.iter_mut().zip(&about.linear) {
            let Some(row) = row else { continue };
            let back = joints_of(row.mask).map(|joint| {
                row.by_joint[joint].dot(&(self.measured.joints[joint] - state.joints[joint]))
            });
            let stature = row.by_stature * (self.measured.stature - state.stature);
            *gap = -(row.residual + back.sum::<f64>() + stature);
        }
        let pulls = about.normal.solve(&gaps);
        let mut target = self.measured;
        for (a, row) in about.linear.iter().enumerate() {
            let Some(row) = row else { continue };
            for joint in joints_of(row.mask) {
                target.joints[joint] += pulls[a] * about.follow[a][joint];
            }
            target.stature += pulls[a] * row.by_stature * STATURE_VARIANCE;
        }
        let is_finite = target.joints.iter().flatten().all(|joint| joint.is_finite());
        (is_finite && target.stature.is_finite()).then_some(target)
    }

    fn result(&self, state: &State, iterations: usize) -> Option<Refined> {
        let about = self.about(state)?;
        let covariance = |joint: usize| {
            let mut by_row = SMatrix::<f64, N_ROWS, 3>::zeros();
            for (row, follow) in about.follow.iter().enumerate() {
                by_row.set_row(row, &follow[joint].transpose());
            }
            let gained = by_row.transpose() * about.normal.solve(&by_row);
            let left = self.covariances[joint] - gained;
            0.5 * (left + left.transpose())
        };
        let mut it = self.unchanged();
        it.iterations = iterations;
        for joint in (0..N_JOINTS).filter(|joint| self.present[*joint]) {
            let left = covariance(joint);
            if !left.iter().all(|entry| entry.is_finite()) {
                return None;
            }
            it.joints[joint] = Some(Point3::from(state.joints[joint]));
            it.covariances[joint] = Some(left);
        }
        Some(it)
    }

    fn unchanged(&self) -> Refined {
        let if_there = |joint: usize| self.present[joint].then_some(joint);
        Refined {
            joints: core::array::from_fn(|i| {
                if_there(i).map(|i| Point3::from(self.measured.joints[i]))
            }),
            covariances: core::array::from_fn(|i| if_there(i).map(|i| self.covariances[i])),
            iterations: 0,
        }
    }
}

/// Returns a usable covariance and its inverse.
fn usable(given: Option<Matrix3<f64>>) -> [Matrix3<f64>; 2] {
    let inverse = |matrix3: &Matrix3<f64>| {
        let inverse = matrix3.cholesky()?.inverse();
        inverse.iter().all(|entry| entry.is_finite()).then_some(inverse)
    };
    let least = Matrix3::from_diagonal_element(LEAST_VARIANCE);
    let given = given
        .filter(|covariance| covariance.iter().all(|entry| entry.abs() < 1e6))
        .map(|covariance| 0.5 * (covariance + covariance.transpose()) + least);
    let both = given.and_then(|covariance| Some([covariance, inverse(&covariance)?]));
    both.unwrap_or_else(|| {
        let variance = UNKNOWN_SD * UNKNOWN_SD;
        [variance, 1.0 / variance].map(Matrix3::from_diagonal_element)
    })
}

#[cfg(test)]
mod tests;
