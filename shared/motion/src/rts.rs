//! The Rauch-Tung-Striebel smoother over one continuous stretch of a track, with small weights for outliers.

use nalgebra::{Matrix3, Vector3};

use crate::model::{Belief, Innovation};
use crate::noise::Noise;

/// A usable measurement.
pub(crate) type Usable = Option<(Vector3<f64>, Matrix3<f64>)>;

/// Degrees of freedom of the heavy-tailed (Student) noise that determines the weights of measurements.
pub(crate) const FREEDOM: f64 = 4.0;
/// A measurement is rejected if its squared Mahalanobis distance from the estimate by the other measurements exceeds this limit. This
/// rejects 1 of 10 000 good measurements.
pub(crate) const GATE: f64 = 21.11;
/// Factor on the covariance of the estimate by the other measurements. It is above 1 because movement is sometimes less predictable than
/// the track as a whole: a punch is not an outlier. At high frame rates, it has little effect, because the measurement's own covariance
/// dominates the sum.
const SURPRISE: f64 = 9.0;
/// Number of rounds in which the weights are computed; they converge within this number.
const N_ROUNDS: usize = 4;

/// Position of a joint with its covariance, which has the same scale as the covariances of the measurements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    pub(crate) position: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
}

/// States of a stretch, computed from all of its measurements.
#[derive(Debug)]
pub(crate) struct Stretch {
    /// State at every instant; empty if there is no measurement.
    pub(crate) known: Vec<Known>,
    /// Weight of the measurement at every instant, from 0 to 1; 0 if it is rejected or missing.
    pub(crate) weights: Vec<f64>,
}

/// Returns the weight of a measurement under noise with heavy tails (Lange, Little & Taylor 1989).
///
/// * `distance2`: squared Mahalanobis distance, scaled.
pub(crate) fn weight(distance2: f64) -> f64 {
    ((FREEDOM + 3.0) / (FREEDOM + distance2)).min(1.0)
}

/// Filters forwards. `each` is called with every measurement before it is used, and returns its weight; a weight of 0 leaves it out.
///
/// * Returns the state at every instant up to the last. Instants before the first used measurement have the state of that measurement.
pub(crate) fn forwards(
    times: &[f64],
    measured: &[Usable],
    noise: Noise,
    mut each: impl FnMut(usize, Option<Innovation>) -> f64,
) -> Vec<Belief> {
    let mut beliefs: Vec<Belief> = Vec::with_capacity(times.len());
    let jerk = noise.jerk / noise.scale;
    let mut n_before = 0;
    for (at, it) in measured.iter().enumerate() {
        let Some(last) = beliefs.last() else {
            let first = it.filter(|_| each(at, None) > 0.0);
            if let Some((position, covariance)) = first {
                beliefs.push(Belief::first(position, covariance, noise.scale));
            } else {
                n_before += 1;
            }
            continue;
        };
        let expected = last.after(times[at] - times[at - 1], jerk);
        let known = it.map_or(expected, |(position, covariance)| {
            let weight = each(at, expected.innovation(&position, &covariance));
            if weight > 0.0 {
                expected.with(&position, &(covariance / weight))
            } else {
                expected
            }
        });
        beliefs.push(known);
    }
    // Before the first measurement, nothing is known; the backward pass covers these instants.
    let Some(first) = beliefs.first().copied() else {
        return beliefs;
    };
    let mut all = vec![first; n_before];
    all.append(&mut beliefs);
    all
}

/// Smooths the result of [`forwards`] backwards.
fn backwards(times: &[f64], forwards: &[Belief], noise: Noise) -> Vec<Known> {
    let jerk = noise.jerk / noise.scale;
    let known = |belief: &Belief| Known {
        position: belief.position(),
        covariance: belief.position_covariance(),
    };
    let mut all: Vec<Known> = forwards.iter().map(known).collect();
    let Some(mut next) = forwards.last().copied() else {
        return all;
    };
    for at in (0..forwards.len() - 1).rev() {
        let dt = times[at + 1] - times[at];
        let predicted = forwards[at].after(dt, jerk);
        next = forwards[at].smoothed(&predicted, &next, dt);
        all[at] = known(&next);
    }
    all
}

/// Returns the squared Mahalanobis distance of a measurement from the estimate by all *other* measurements, scaled; infinite if it cannot
/// be computed.
///
/// * `weight`: weight of the measurement in the estimate; 0 if it was not used.
pub(crate) fn distance2(
    known: &Known,
    (position, covariance): &(Vector3<f64>, Matrix3<f64>),
    weight: f64,
    scale: f64,
) -> f64 {
    if weight <= 0.0 {
        let difference = position - known.position;
        return solved(&(known.covariance * SURPRISE + covariance), &difference) / scale;
    }
    // The estimate without this measurement: the information of all measurements minus its own.
    let (Some(all), Some(own)) = (known.covariance.try_inverse(), covariance.try_inverse()) else {
        return f64::INFINITY;
    };
    let own = own * weight;
    let is_known = |matrix3: &Matrix3<f64>| matrix3.diagonal().iter().all(|value| *value > 0.0);
    let Some(others) = (all - own).try_inverse().filter(is_known) else {
        return 0.0; // Nothing but this measurement is known here.
    };
    let mean = others * (all * known.position - own * position);
    solved(&(others * SURPRISE + covariance), &(position - mean)) / scale
}

fn solved(total: &Matrix3<f64>, difference: &Vector3<f64>) -> f64 {
    let root = total.cholesky();
    root.map_or(f64::INFINITY, |root| {
        difference.dot(&root.solve(difference))
    })
}

/// Smooths a stretch: outliers get a smaller weight, and measurements that contradict all others are left out.
pub(crate) fn smooth(times: &[f64], measured: &[Usable], noise: Noise) -> Stretch {
    let mut weights: Vec<f64> = vec![0.0; times.len()];
    let known = forwards(times, measured, noise, |at, innovation| {
        let distance2 = innovation.map_or(0.0, |innovation| innovation.distance2 / noise.scale);
        weights[at] = weight(distance2);
        weights[at]
    });
    let mut known = backwards(times, &known, noise);
    for round in 0..N_ROUNDS {
        let is_last = round + 1 == N_ROUNDS;
        let mut next = weights.clone();
        for ((at, it), known) in measured.iter().enumerate().zip(&known) {
            if let Some(it) = it {
                let distance2 = distance2(known, it, weights[at], noise.scale);
                let is_out = is_last && distance2 > GATE;
                next[at] = if is_out { 0.0 } else { weight(distance2) };
            }
        }
        if next.iter().all(|value| *value == 0.0) {
            break; // Nothing would be left.
        }
        weights = next;
        known = backwards(
            times,
            &forwards(times, measured, noise, |at, _| weights[at]),
            noise,
        );
    }
    Stretch { known, weights }
}

#[cfg(test)]
mod tests;
