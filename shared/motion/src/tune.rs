//! Estimates the jerk density of a joint and the scale of its covariances from the measurements alone.

use statistics::Sorted;

use crate::noise::{Noise, Prior};
use crate::rts::{FREEDOM, Usable, forwards, weight};

/// Minimum jerk density that is tried, as a common logarithm; the next constants are the maximum and the step.
const LEAST: f64 = -1.0;
const MOST: f64 = 5.5;
const STEP: f64 = 0.5;
/// Standard deviation of the natural logarithm of the scale before any measurement: covariances are correct to within a factor of 3.
const SCALE_SD: f64 = 1.0;
/// Weight of the likelihood. It is below 1 because people do not move exactly as the model assumes, so the innovations carry less
/// information. Otherwise, fast movement at a low frame rate would be taken for noise.
const SHARE: f64 = 0.1;
/// Minimum and maximum plausible scale.
const SCALES: [f64; 2] = [1e-4, 1e4];
/// Minimum number of measurements from which noise parameters are estimated.
const LEAST_MEASURED: usize = 12;
/// Number of windows that are used of a long track; the next constant is the number of instants in each window.
const N_WINDOWS: usize = 6;
const WINDOW: usize = 250;
/// Number of innovations at the beginning of a window that are not counted, because they depend on the initial assumptions.
const SKIPPED: usize = 3;

/// Estimates the noise parameters of a track by maximising the likelihood of the innovations, assuming noise with heavy tails. The search
/// uses a grid of jerk densities, with the scale estimated for each.
///
/// A filter depends only on the ratio of the two parameters. So for every ratio, one run gives all innovations and the scale that explains
/// them best. For a long track, only some windows are used.
///
/// * `stretches`: stretches of the track, each with its times in ascending order.
pub(crate) fn tune(stretches: &[(&[f64], &[Usable])], prior: Prior) -> Noise {
    let windows = windows(stretches);
    let n: usize = windows.iter().map(|window| window.1.iter().flatten().count()).sum();
    let expected = Noise {
        jerk: 10.0_f64.powf(prior.log10_jerk),
        scale: 1.0,
    };
    if n < LEAST_MEASURED {
        return expected;
    }
    let mut scale = 1.0;
    let mut tried = Vec::new();
    let n_steps = ((MOST - LEAST) / STEP) as usize;
    for step in 0..=n_steps {
        let log10_jerk = MOST - STEP * step as f64;
        let (score, found) = score(&windows, 10.0_f64.powf(log10_jerk), scale);
        scale = found;
        let unlikely =
            ((log10_jerk - prior.log10_jerk) / prior.sd).powi(2) + (found.ln() / SCALE_SD).powi(2);
        tried.push((log10_jerk, SHARE * score - 0.5 * unlikely, found));
    }
    let best = (0..tried.len()).max_by(|&a, &b| tried[a].1.total_cmp(&tried[b].1));
    let Some(best) = best else {
        return expected;
    };
    let offset = vertex(&tried, best);
    Noise {
        jerk: 10.0_f64.powf(tried[best].0 - STEP * offset),
        scale: tried[best].2,
    }
}

/// Returns the position of the maximum of the parabola through the best value and its neighbours, in steps relative to the best value.
fn vertex(tried: &[(f64, f64, f64)], best: usize) -> f64 {
    if best == 0 || best + 1 >= tried.len() {
        return 0.0;
    }
    let [before, at, after] = [best - 1, best, best + 1].map(|i| tried[i].1);
    let bend = before - 2.0 * at + after;
    if bend < 0.0 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

/// Returns the whole of a short track, or windows of a long track.
fn windows<'a>(stretches: &[(&'a [f64], &'a [Usable])]) -> Vec<(&'a [f64], &'a [Usable])> {
    let n: usize = stretches.iter().map(|stretch| stretch.0.len()).sum();
    if n <= N_WINDOWS * WINDOW {
        return stretches.to_vec();
    }
    let chunks = stretches
        .iter()
        .flat_map(|(times, measured)| times.chunks(WINDOW).zip(measured.chunks(WINDOW)));
    let chunks: Vec<_> = chunks
        .filter(|chunk| chunk.1.iter().flatten().count() * 2 > chunk.1.len().min(WINDOW / 2))
        .collect();
    let every = chunks.len().div_ceil(N_WINDOWS).max(1);
    chunks.into_iter().step_by(every).collect()
}

/// Returns the logarithm of the likelihood of the innovations, and the scale that maximises it.
///
/// * `jerk`: density in m²/s⁵. The filter depends on its ratio to the scale, so it is run again with the estimated scale.
fn score(windows: &[(&[f64], &[Usable])], jerk: f64, scale: f64) -> (f64, f64) {
    let mut scale = scale;
    let mut score = f64::NEG_INFINITY;
    for _ in 0..3 {
        let noise = Noise { jerk, scale };
        let (mut distances, mut log_determinants) = (Vec::new(), 0.0);
        for (times, measured) in windows {
            let mut n_seen = 0;
            forwards(times, measured, noise, |_, innovation| {
                n_seen += 1;
                let Some(it) = innovation else { return 1.0 };
                if n_seen > SKIPPED {
                    distances.push(it.distance2);
                    log_determinants += it.log_determinant;
                }
                weight(it.distance2 / scale)
            });
        }
        let found = scale_of(&distances).clamp(SCALES[0], SCALES[1]);
        let student = found * GAUSSIAN_SHARE;
        let n = distances.len() as f64;
        let tails: f64 =
            distances.iter().map(|distance| (distance / (FREEDOM * student)).ln_1p()).sum();
        score = -0.5 * (log_determinants + 3.0 * n * student.ln() + (FREEDOM + 3.0) * tails);
        let is_settled = (found / scale).ln().abs() < 0.02;
        scale = found;
        if is_settled {
            break;
        }
    }
    (score, scale)
}

/// Ratio of [`student_scale`] to the variance if the noise is actually Gaussian, in three dimensions.
const GAUSSIAN_SHARE: f64 = 0.757;

/// Returns a scale of squared distances that is correct for Gaussian noise and robust against outliers.
fn scale_of(distances: &[f64]) -> f64 {
    student_scale(distances) / GAUSSIAN_SHARE
}

/// Returns the most likely scale of squared distances in three-dimensional Student noise.
fn student_scale(distances: &[f64]) -> f64 {
    let sorted = Sorted::new(distances.to_vec());
    // The median of the chi-squared distribution with 3 degrees of freedom is 2.366.
    let Some(median) = sorted.interpolated(0.5) else {
        return 1.0;
    };
    let mut scale = (median / 2.366).max(1e-12);
    let n = distances.len() as f64;
    for _ in 0..30 {
        let sum: f64 = distances
            .iter()
            .map(|distance| distance * (FREEDOM + 3.0) / (FREEDOM + distance / scale))
            .sum();
        let next = (sum / (3.0 * n)).max(1e-12);
        let is_settled = (next / scale).ln().abs() < 1e-4;
        scale = next;
        if is_settled {
            break;
        }
    }
    scale
}
