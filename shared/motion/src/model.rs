//! The motion model: a point whose jerk is white noise, measured with a separate covariance at every instant.
//!
//! The state consists of position, velocity and acceleration along three axes; the covariances of measurements couple the axes. Between two
//! instants `dt` apart, the acceleration follows a random walk: the Wiener-process acceleration model (Bar-Shalom, Li & Kirubarajan,
//! *Estimation with Applications to Tracking and Navigation*, 2001, section 6.2.3). Its spectral density, here called the jerk density, has
//! the unit m²/s⁵.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A vector of position, velocity and acceleration.
pub(crate) type Vector9 = SVector<f64, 9>;
pub(crate) type Matrix9 = SMatrix<f64, 9, 9>;
type Matrix9x3 = SMatrix<f64, 9, 3>;

/// Initial standard deviations of the velocity (m/s) and acceleration (m/s²) of a person's joint.
const START_SD: [f64; 2] = [2.0, 15.0];

/// State of a joint at one instant, with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Belief {
    pub(crate) mean: Vector9,
    pub(crate) covariance: Matrix9,
}

/// How well a measurement agrees with the prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Innovation {
    /// Squared Mahalanobis distance; its expected value is 3.
    pub(crate) distance2: f64,
    /// Logarithm of the determinant of the covariance of the difference.
    pub(crate) log_determinant: f64,
}

impl Belief {
    /// Creates the state from the first measurement.
    ///
    /// * `scale`: factor by which all covariances were divided; 1 if they were not scaled.
    pub(crate) fn first(position: Vector3<f64>, covariance: Matrix3<f64>, scale: f64) -> Self {
        let mut mean = Vector9::zeros();
        mean.fixed_rows_mut::<3>(0).copy_from(&position);
        let mut all = Matrix9::zeros();
        all.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
        for i in 0..3 {
            all[(3 + i, 3 + i)] = START_SD[0].powi(2) / scale;
            all[(6 + i, 6 + i)] = START_SD[1].powi(2) / scale;
        }
        Self {
            mean,
            covariance: all,
        }
    }

    /// Returns the position.
    pub(crate) fn position(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(0).into_owned()
    }

    /// Returns the covariance of the position.
    pub(crate) fn position_covariance(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Returns the predicted state `dt` seconds later.
    pub(crate) fn after(&self, dt: f64, jerk: f64) -> Self {
        let mut mean = self.mean;
        for i in 0..3 {
            let (v, a) = (self.mean[3 + i], self.mean[6 + i]);
            mean[i] += dt * v + 0.5 * dt * dt * a;
            mean[3 + i] += dt * a;
        }
        let left = moved(&self.covariance, dt);
        let mut covariance = moved(&left.transpose(), dt);
        let powers = [1, 2, 3, 4, 5].map(|i| jerk * dt.powi(i));
        let [t1, t2, t3, t4, t5] = powers;
        for i in 0..3 {
            covariance[(i, i)] += t5 / 20.0;
            covariance[(3 + i, 3 + i)] += t3 / 3.0;
            covariance[(6 + i, 6 + i)] += t1;
            for (a, b, value) in [
                (i, 3 + i, t4 / 8.0),
                (i, 6 + i, t3 / 6.0),
                (3 + i, 6 + i, t2 / 2.0),
            ] {
                covariance[(a, b)] += value;
                covariance[(b, a)] += value;
            }
        }
        Self { mean, covariance }
    }

    /// Returns how well a measurement agrees with the state before the measurement is used; `None` if this cannot be computed.
    pub(crate) fn innovation(
        &self,
        position: &Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Option<Innovation> {
        let total = self.position_covariance() + covariance;
        let root = total.cholesky()?;
        let difference = position - self.position();
        let distance2 = difference.dot(&root.solve(&difference));
        let log_determinant =
            2.0 * root.l().diagonal().iter().map(|diagonal| diagonal.ln()).sum::<f64>();
        Some(Innovation {
            distance2,
            log_determinant,
        })
    }

    /// Returns the state after a measurement; the state is unchanged if the measurement is numerically unusable.
    #[must_use]
    pub(crate) fn with(&self, position: &Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        let total = self.position_covariance() + covariance;
        let Some(inverse) = total.try_inverse() else {
            return *self;
        };
        let columns: Matrix9x3 = self.covariance.fixed_view::<9, 3>(0, 0).into_owned();
        let gain: Matrix9x3 = columns * inverse;
        let mean = self.mean + gain * (position - self.position());
        let reduced = self.covariance - gain * columns.transpose();
        let covariance = (reduced + reduced.transpose()) * 0.5;
        Self { mean, covariance }
    }

    /// Returns the state smoothed with all later measurements (Rauch, Tung & Striebel 1965).
    ///
    /// * `self`: state from all measurements up to its own instant.
    /// * `predicted`: [`Self::after`] of this state at the next instant.
    /// * `next`: smoothed state at the next instant.
    #[must_use]
    pub(crate) fn smoothed(&self, predicted: &Self, next: &Self, dt: f64) -> Self {
        let Some(root) = predicted.covariance.cholesky() else {
            return *self;
        };
        // The gain is P F' (P-)^-1; its transpose is (P-)^-1 F P.
        let gain = root.solve(&moved(&self.covariance, dt)).transpose();
        let mean = self.mean + gain * (next.mean - predicted.mean);
        let change = gain * (next.covariance - predicted.covariance) * gain.transpose();
        let covariance = self.covariance + (change + change.transpose()) * 0.5;
        Self { mean, covariance }
    }
}

/// Applies the transition from the left.
fn moved(matrix: &Matrix9, dt: f64) -> Matrix9 {
    let mut moved = *matrix;
    let half = 0.5 * dt * dt;
    for column in 0..9 {
        for i in 0..3 {
            let (v, a) = (matrix[(3 + i, column)], matrix[(6 + i, column)]);
            moved[(i, column)] += dt * v + half * a;
            moved[(3 + i, column)] += dt * a;
        }
    }
    moved
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn start() -> Belief {
        let covariance = Matrix3::new(4e-4, 1e-4, 0.0, 1e-4, 9e-4, 2e-5, 0.0, 2e-5, 1e-4);
        Belief::first(Vector3::new(1.0, 2.0, 3.0), covariance, 1.0)
    }

    proptest! {
        #[test]
        fn two_short_prediction_steps_equal_one_long_step(a in 0.001..0.5_f64, b in 0.001..0.5_f64, jerk in 0.1..1e4_f64) {
            let mut moving = start();
            for value in moving.mean.iter_mut().skip(3) {
                *value = 2.0;
            }
            let once = moving.after(a + b, jerk);
            let twice = moving.after(a, jerk).after(b, jerk);
            prop_assert!((once.covariance - twice.covariance).norm() < 1e-9 * once.covariance.norm());
            prop_assert!((once.mean - twice.mean).norm() < 1e-9);
        }

        #[test]
        fn a_measurement_never_adds_uncertainty(x in -1.0..1.0_f64, sd in 1e-4..1.0_f64) {
            let before = start().after(0.1, 100.0);
            let after = before.with(&Vector3::new(x, 0.0, 0.0), &(Matrix3::identity() * sd * sd));
            for i in 0..9 {
                prop_assert!(after.covariance[(i, i)] <= before.covariance[(i, i)] * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn smoothing_without_new_information_changes_nothing() {
        let before = start();
        let predicted = before.after(0.1, 10.0);
        let got = before.smoothed(&predicted, &predicted, 0.1);
        assert!((got.mean - before.mean).norm() < 1e-12);
        assert!((got.covariance - before.covariance).norm() < 1e-9);
    }
}
