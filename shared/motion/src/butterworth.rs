//! The low-pass filter used in gait laboratories: a Butterworth filter, run forwards and backwards, so that there is no delay.

use core::f64::consts::PI;

use nalgebra::Vector3;

use crate::recorded::{Counts, Motion, Recorded, Report, median};
use crate::track::{Absent, Estimate, Smoothed, State};

/// Factor by which the cutoff frequency falls when a filter of second order is applied twice (Winter, *Biomechanics and Motor Control of
/// Human Movement*, 4th ed., section 3.4.4.2): (sqrt(2) - 1)^(1/4).
const TWICE: f64 = 0.802;

/// The error for a cutoff frequency that is too high for the frame rate.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "a cutoff frequency of {cutoff_hz} Hz needs a frame rate above {} Hz, but the frame rate is {rate_hz:.3} Hz",
    needed_hz(*cutoff_hz)
)]
pub struct CutoffError {
    /// The cutoff frequency, in Hz.
    pub cutoff_hz: f64,
    /// Number of instants per second, in Hz.
    pub rate_hz: f64,
}

/// Returns the lowest rate, in Hz, at which a cutoff frequency can be used. With the bilinear transform, the cutoff can be up to 0.45 of
/// the rate.
fn needed_hz(cutoff_hz: f64) -> f64 {
    cutoff_hz / TWICE / 0.45
}

/// Filters every joint: a Butterworth filter of second order forwards and backwards. Together, the two passes are a filter of fourth order
/// without delay, which passes half of the power at the cutoff.
///
/// Gaps of up to `fill_s` between measurements are first filled by cubic curves. Longer gaps split a track into pieces that are filtered
/// separately. Non-uniform instants are interpolated (cubic) to a uniform grid and back; [`Report::resampled_s`] is the largest difference
/// from the grid. The only measurements rejected are those of left and right joints at instants at which left and right are uncertain. The
/// result has no covariances.
///
/// The times must be [checked](Recorded::check).
///
/// # Errors
///
/// [`CutoffError`].
pub fn filter(recorded: &Recorded, cutoff_hz: f64, fill_s: f64) -> Result<Motion, CutoffError> {
    let times = &recorded.times;
    let step = median(times.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let rate_hz = if step > 0.0 {
        1.0 / step
    } else {
        f64::INFINITY
    };
    let is_possible = cutoff_hz > 0.0 && rate_hz >= needed_hz(cutoff_hz);
    if !is_possible {
        return Err(CutoffError { cutoff_hz, rate_hz });
    }
    let breaks = recorded.breaks();
    let withheld = recorded.withheld();
    let mut joints = Vec::new();
    for (joint, it) in recorded.joints.iter().enumerate() {
        let known: Vec<(usize, Vector3<f64>)> = (0..times.len())
            .filter(|&at| !withheld(joint, at))
            .filter_map(|at| Some((at, it.position(at)?)))
            .collect();
        let absent = |at: usize| Err(it.absent(at));
        let mut track: Vec<Smoothed> = (0..times.len()).map(absent).collect();
        for piece in pieces(&known, times, &breaks, fill_s) {
            if step > 0.0 {
                fill(&mut track, piece, times, step, cutoff_hz);
            }
        }
        joints.push(track);
    }
    let counts = joints.iter().map(|joint| Counts::of(joint)).collect();
    let report = Report {
        noise: vec![None; joints.len()],
        counts,
        breaks,
        unsure: recorded.unsure(),
        resampled_s: Some(off_grid(times, step)).filter(|value| *value > 0.01 * step),
        ..Report::default()
    };
    Ok(Motion { joints, report })
}

/// Returns the maximum difference of the instants from a uniform grid; missing instants do not count as a difference.
fn off_grid(times: &[f64], step: f64) -> f64 {
    let first = times.first().copied().unwrap_or(0.0);
    let off = |time: &f64| {
        let at = (time - first) / step;
        (at - at.round()).abs() * step
    };
    times.iter().map(off).fold(0.0, f64::max)
}

/// Returns the parts of a track that contain no long gap and no break.
fn pieces<'a>(
    known: &'a [(usize, Vector3<f64>)],
    times: &[f64],
    breaks: &[usize],
    fill_s: f64,
) -> Vec<&'a [(usize, Vector3<f64>)]> {
    let step = median(times.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let goes_on = |a: &(usize, Vector3<f64>), b: &(usize, Vector3<f64>)| {
        let is_near = times[b.0] - times[a.0] <= fill_s.max(1.5 * step);
        is_near && !breaks.iter().any(|index| (a.0 + 1..=b.0).contains(index))
    };
    known.chunk_by(goes_on).collect()
}

/// Filters a part of a track, and computes positions for all instants from its first to its last.
fn fill(
    track: &mut [Smoothed],
    piece: &[(usize, Vector3<f64>)],
    times: &[f64],
    step: f64,
    cutoff_hz: f64,
) {
    let [Some(first), Some(last)] = [piece.first(), piece.last()] else {
        return;
    };
    let (begin, end) = (times[first.0], times[last.0]);
    let n = ((end - begin) / step).round() as usize + 1;
    // The step is adjusted so that the grid ends on the last instant.
    let step = if n > 1 {
        (end - begin) / (n - 1) as f64
    } else {
        step
    };
    let grid: Vec<f64> = (0..n).map(|at| begin + step * at as f64).collect();
    let at: Vec<f64> = piece.iter().map(|piece| times[piece.0]).collect();
    let mut filtered = vec![Vector3::zeros(); last.0 - first.0 + 1];
    for axis in 0..3 {
        let values: Vec<f64> = piece.iter().map(|piece| piece.1[axis]).collect();
        let uniform: Vec<f64> = grid.iter().map(|&time| cubic(&at, &values, time)).collect();
        let smooth = twice(&uniform, 1.0 / step, cutoff_hz);
        for (nth, it) in filtered.iter_mut().enumerate() {
            it[axis] = cubic(&grid, &smooth, times[first.0 + nth]);
        }
    }
    let mut known = piece.iter().map(|piece| piece.0).peekable();
    for (nth, position) in filtered.into_iter().enumerate() {
        let here = first.0 + nth;
        let state = if known.next_if_eq(&here).is_some() {
            State::Measured
        } else if track[here] == Err(Absent::Rejected) {
            State::Rejected
        } else {
            State::Filled
        };
        track[here] = Ok(Estimate {
            position,
            covariance: None,
            state,
        });
    }
}

/// Returns the value of the cubic curve through all values at a time, with slopes from the neighbours (Catmull & Rom 1974).
fn cubic(times: &[f64], values: &[f64], time: f64) -> f64 {
    let after = times.partition_point(|known| *known <= time);
    if after == 0 || times.len() < 2 {
        return values.first().copied().unwrap_or(f64::NAN);
    }
    let a = after - 1;
    if after >= times.len() {
        return values[a];
    }
    let slope = |at: usize| {
        let (from, to) = (at.saturating_sub(1), (at + 1).min(times.len() - 1));
        (values[to] - values[from]) / (times[to] - times[from])
    };
    let width = times[after] - times[a];
    let u = (time - times[a]) / width;
    let (one, two, three) = (u, u * u, u * u * u);
    values[a] * (2.0 * three - 3.0 * two + 1.0)
        + width * slope(a) * (three - 2.0 * two + one)
        + values[after] * (3.0 * two - 2.0 * three)
        + width * slope(after) * (three - two)
}

/// Filters forwards and then backwards; both ends are extended by their point reflection for one period of the cutoff.
fn twice(values: &[f64], rate_hz: f64, cutoff_hz: f64) -> Vec<f64> {
    let n = values.len();
    if n < 2 {
        return values.to_vec();
    }
    let n_around = ((2.0 * rate_hz / cutoff_hz).ceil() as usize).clamp(1, n - 1);
    let before = (1..=n_around).rev().map(|i| 2.0 * values[0] - values[i]);
    let after = (1..=n_around).map(|i| 2.0 * values[n - 1] - values[n - 1 - i]);
    let mut all: Vec<f64> = before.chain(values.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        once(&mut all, rate_hz, cutoff_hz / TWICE);
        all.reverse();
    }
    all[n_around..n_around + n].to_vec()
}

/// A Butterworth low-pass filter of second order (bilinear transform, prewarped). It starts in the steady state of the first value.
fn once(values: &mut [f64], rate_hz: f64, cutoff_hz: f64) {
    let warped = (PI * cutoff_hz / rate_hz).tan();
    let (root, square) = (2.0_f64.sqrt() * warped, warped * warped);
    let norm = 1.0 / (1.0 + root + square);
    let b = square * norm;
    let a = [2.0 * (square - 1.0) * norm, (1.0 - root + square) * norm];
    let first = values.first().copied().unwrap_or(0.0);
    let (mut x, mut y) = ([first; 2], [first; 2]);
    for value in values {
        let input = *value;
        let output = b * (input + 2.0 * x[0] + x[1]) - a[0] * y[0] - a[1] * y[1];
        (x, y) = ([input, x[0]], [output, y[0]]);
        *value = output;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the fraction of a sine's amplitude that remains in phase with the input.
    fn passed(hz: f64) -> f64 {
        let rate = 120.0;
        let wave: Vec<f64> =
            (0..1200).map(|i| (2.0 * PI * hz * f64::from(i) / rate).sin()).collect();
        let got = twice(&wave, rate, 6.0);
        let (mut same, mut all) = (0.0, 0.0);
        for at in 300..900 {
            same += got[at] * wave[at];
            all += wave[at] * wave[at];
        }
        same / all
    }

    #[test]
    fn half_of_the_power_passes_at_the_cutoff_and_slow_movement_is_unchanged() {
        assert!(
            (passed(6.0) - 0.5_f64.sqrt()).abs() < 0.005,
            "{}",
            passed(6.0)
        );
        assert!((passed(0.5) - 1.0).abs() < 1e-3);
        assert!(passed(20.0) < 0.02);
    }

    #[test]
    fn a_straight_line_is_unchanged_up_to_its_ends() {
        let line: Vec<f64> = (0..50).map(|i| 0.3 * f64::from(i) - 2.0).collect();
        for (got, want) in twice(&line, 60.0, 6.0).iter().zip(&line) {
            assert!((got - want).abs() < 1e-2, "{got} {want}");
        }
    }

    #[test]
    fn a_cubic_curve_goes_through_its_points_and_along_lines() {
        let times = [0.0, 0.1, 0.25, 0.3, 0.5];
        let values = times.map(|time| 3.0 * time + 1.0);
        for time in [0.0, 0.05, 0.1, 0.2, 0.31, 0.5] {
            assert!((cubic(&times, &values, time) - (3.0 * time + 1.0)).abs() < 1e-12);
        }
    }
}
