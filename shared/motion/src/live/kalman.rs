//! Several Kalman filters with different jerk densities run side by side, weighted by the quality of their recent predictions.
//!
//! This is the static multiple-model estimator (Bar-Shalom, Li & Kirubarajan 2001, section 11.6.2) with a limited memory. Older
//! measurements have less weight, so the filters adapt to a person who begins to run.

use core::f64::consts::PI;

use nalgebra::{Complex, Matrix3, RowVector3, Vector3};

use crate::model::Belief;
use crate::noise::Prior;
use crate::rts::{FREEDOM, GATE, weight};
use crate::track::{Absent, Estimate, Measured, Smoothed, State, usable};

/// Number of filters. The next constants are the lowest jerk density and the step from one filter to the next, as common logarithms
/// relative to the density expected for the joint. For most people, the jerk density is a hundred times higher when they run than when they
/// stand.
const N_MODELS: usize = 6;
const CALMEST: f64 = -1.0;
const APART: f64 = 1.0;
/// Time constant with which accelerations decay while nothing is measured, in seconds.
const CALM_S: f64 = 0.1;
/// Time after which measurements no longer have much effect on the weights, in seconds.
const MEMORY_S: f64 = 2.0;
/// Maximum time without a measurement before the filters of a joint are restarted, in seconds.
const FORGET_S: f64 = 1.0;
/// Minimum and maximum plausible scale of covariances.
const SCALES: [f64; 2] = [1e-2, 1e2];
/// Number of successive measurements that contradict the prediction after which the measurements are trusted instead of the prediction.
const MOST_REJECTED: u32 = 5;
/// Frequency of the movement for which the delay is reported, in Hz.
const DELAY_HZ: f64 = 1.0;

/// The filters of one joint.
#[derive(Debug)]
pub(super) struct Models {
    prior: Prior,
    filters: Option<[Model; N_MODELS]>,
    time_s: f64,
    measured_s: f64,
    n_rejected: u32,
}

#[derive(Debug, Clone, Copy)]
struct Model {
    /// Jerk density divided by the scale of the covariances, in m²/s⁵.
    ratio: f64,
    belief: Belief,
    scale: f64,
    /// Log-likelihood of the measurements, with less weight for older ones.
    score: f64,
}

impl Models {
    pub(super) fn new(prior: Prior) -> Self {
        Self {
            prior,
            filters: None,
            time_s: f64::NEG_INFINITY,
            measured_s: f64::NEG_INFINITY,
            n_rejected: 0,
        }
    }

    /// * Returns the position, which is a prediction if nothing was measured. Also returns the delay of movement at 1 Hz, in seconds.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        measured: Option<&Measured>,
        fill_s: f64,
    ) -> (Smoothed, Option<f64>) {
        let dt = time_s - self.time_s;
        let is_old = time_s - self.measured_s > FORGET_S.max(fill_s);
        if dt <= 0.0 || !dt.is_finite() || is_old {
            self.filters = None;
        }
        let measured = measured.and_then(usable);
        self.time_s = time_s;
        let Some(models) = &mut self.filters else {
            return (self.begin(measured), None);
        };
        for it in models.iter_mut() {
            it.belief = it.belief.after(dt, it.ratio);
        }
        let Some((position, covariance)) = measured else {
            for it in models.iter_mut() {
                it.belief.mean.fixed_rows_mut::<3>(6).scale_mut((-dt / CALM_S).exp());
            }
            let is_near = time_s - self.measured_s <= fill_s;
            let state = State::Filled;
            return (
                said(models, state).filter(|_| is_near).ok_or(Absent::Gap),
                None,
            );
        };
        let is_out = |model: &Model| {
            let innovation = model.belief.innovation(&position, &covariance);
            innovation.is_none_or(|innovation| innovation.distance2 > GATE * model.scale)
        };
        if models.iter().all(is_out) {
            self.n_rejected += 1;
            if self.n_rejected > MOST_REJECTED {
                return (self.begin(Some((position, covariance))), None);
            }
            let is_near = time_s - self.measured_s <= fill_s;
            let said = said(models, State::Rejected).filter(|_| is_near);
            return (said.ok_or(Absent::Rejected), None);
        }
        self.n_rejected = 0;
        self.measured_s = time_s;
        let mut delays = [0.0; N_MODELS];
        for (it, delay) in models.iter_mut().zip(&mut delays) {
            let gain = it.update(&position, &covariance, dt);
            *delay = delay_s(gain, dt);
        }
        let shares = shares(models);
        let delay_s: f64 = shares.iter().zip(delays).map(|(share, it)| share * it).sum();
        (
            said(models, State::Measured).ok_or(Absent::Gap),
            Some(delay_s),
        )
    }

    /// Restarts the filters from a measurement.
    fn begin(&mut self, measured: Option<(Vector3<f64>, Matrix3<f64>)>) -> Smoothed {
        let Some((position, covariance)) = measured else {
            return Err(Absent::Gap);
        };
        let model = |nth: usize| {
            let away = CALMEST + APART * nth as f64;
            Model {
                ratio: 10.0_f64.powf(self.prior.log10_jerk + away),
                belief: Belief::first(position, covariance, 1.0),
                scale: 1.0,
                score: -0.5 * (away / self.prior.sd).powi(2),
            }
        };
        self.filters = Some(core::array::from_fn(model));
        self.measured_s = self.time_s;
        self.n_rejected = 0;
        Ok(Estimate {
            position,
            covariance: Some(covariance),
            state: State::Measured,
        })
    }
}

impl Model {
    /// Uses a measurement.
    ///
    /// * Returns the gain of position, velocity and acceleration, averaged over the axes.
    fn update(
        &mut self,
        position: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        dt: f64,
    ) -> Vector3<f64> {
        let kept = (-dt / MEMORY_S).exp();
        let Some(it) = self.belief.innovation(position, covariance) else {
            return Vector3::zeros();
        };
        let distance2 = it.distance2 / self.scale;
        let likelihood = it.log_determinant
            + 3.0 * self.scale.ln()
            + (FREEDOM + 3.0) * (distance2 / FREEDOM).ln_1p();
        self.score = kept * self.score - 0.5 * likelihood;
        let seen = weight(distance2) * it.distance2 / 3.0 / 0.757;
        let scale = kept * self.scale + (1.0 - kept) * seen;
        self.scale = scale.clamp(SCALES[0], SCALES[1]);
        let weighted = covariance / weight(distance2);
        let before = self.belief.covariance;
        let total = self.belief.position_covariance() + weighted;
        self.belief = self.belief.with(position, &weighted);
        let inverse = total.try_inverse().unwrap_or_else(Matrix3::zeros);
        Vector3::from_fn(|row, _| {
            let columns = before.fixed_view::<3, 3>(3 * row, 0);
            (columns * inverse).trace() / 3.0
        })
    }
}

/// Returns the weight of every filter; the weights sum to 1.
fn shares(models: &[Model; N_MODELS]) -> [f64; N_MODELS] {
    let best = models.iter().map(|model| model.score).fold(f64::NEG_INFINITY, f64::max);
    let odds = models.each_ref().map(|model| (model.score - best).exp());
    let sum: f64 = odds.iter().sum();
    odds.map(|odd| odd / sum)
}

/// Returns the combined estimate of all filters; `None` if it is not a number.
fn said(models: &[Model; N_MODELS], state: State) -> Option<Estimate> {
    let shares = shares(models);
    let mut position = Vector3::zeros();
    for (it, share) in models.iter().zip(shares) {
        position += it.belief.position() * share;
    }
    let mut covariance = Matrix3::zeros();
    for (it, share) in models.iter().zip(shares) {
        let away = it.belief.position() - position;
        let own = it.belief.position_covariance() * it.scale;
        covariance += (own + away * away.transpose()) * share;
    }
    position.iter().all(|value| value.is_finite()).then_some(Estimate {
        position,
        covariance: Some(covariance),
        state,
    })
}

/// Returns the delay, in seconds, of movement at [`DELAY_HZ`] after a filter with this gain, computed from its phase. It is negative if the
/// filter runs ahead.
fn delay_s(gain: Vector3<f64>, dt: f64) -> f64 {
    let transition = Matrix3::new(1.0, dt, 0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
    let seen = Matrix3::identity() - gain * RowVector3::new(1.0, 0.0, 0.0);
    let feedback = (seen * transition).map(|entry| Complex::new(entry, 0.0));
    let turn = 2.0 * PI * DELAY_HZ * dt;
    let back = Complex::new(turn.cos(), -turn.sin());
    let system = Matrix3::<Complex<f64>>::identity() - feedback * back;
    let response = system
        .try_inverse()
        .map(|inverse| inverse * gain.map(|gain| Complex::new(gain, 0.0)));
    response.map_or(0.0, |response| {
        -response[0].im.atan2(response[0].re) / (2.0 * PI * DELAY_HZ)
    })
}
