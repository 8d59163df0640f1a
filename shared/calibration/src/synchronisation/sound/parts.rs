//! Comparison of successive parts of long recordings, which shows whether the offset is constant or drifts.

use super::beginnings::{Beginnings, HOP_S};
use super::{HEARD_S, LEAST, LEAST_COSINE, MOST_RATIO, SPARE_S};
use crate::synchronisation::doubt::Doubt;

/// Length of a part, in seconds.
const PART_S: f64 = 20.0;
/// Minimum number of parts with an offset for an estimate of the drift.
const LEAST_PARTS: usize = 5;
/// In each part, offsets are searched up to this distance from the common offset, in seconds.
const AROUND_S: f64 = 0.5;
/// Largest accepted error of a drift, accumulated over the recording, in seconds.
const MOST_ERROR_S: f64 = 0.01;
/// A drift is used only if it is at least this number of standard errors.
const SURE: f64 = 4.0;
/// Largest accepted fraction of parts that contradict the others.
const MOST_AWAY: f64 = 0.25;

/// Offset of a camera over time.
#[derive(Debug)]
pub(super) struct Drift {
    line: Option<Line>,
    /// The deviation of parts from the line, and the largest accepted deviation, in seconds; `None` unless too many parts contradict the
    /// line.
    contradiction_s: Option<[f64; 2]>,
}

/// The offset is `at_zero_s + slope * time`, with time by the clock of the camera.
#[derive(Debug, Clone, Copy)]
struct Line {
    at_zero_s: f64,
    slope: f64,
    error: f64,
    length_s: f64,
}

impl Drift {
    fn determined(&self) -> Option<Line> {
        self.line.filter(|line| line.error * line.length_s <= MOST_ERROR_S)
    }

    /// Returns the standard error of the drift, if it is determined.
    pub(super) fn error(&self) -> Option<f64> {
        self.determined().map(|determined| determined.error)
    }

    fn line(&self) -> Option<Line> {
        let line = self.determined();
        line.filter(|line| line.slope.abs() >= SURE * line.error)
    }

    /// Returns the amount by which a second of the camera's clock is longer than a second of the reference clock; 0 if it cannot be
    /// distinguished from 0.
    pub(super) fn sure(&self) -> f64 {
        self.line().map_or(0.0, |line| line.slope)
    }

    /// Returns the offset at time 0 of the camera.
    ///
    /// * `constant_s`: offset if there is no drift.
    pub(super) fn offset_s(&self, constant_s: f64) -> f64 {
        self.line().map_or(constant_s, |line| line.at_zero_s)
    }

    pub(super) fn doubt(&self, camera: usize) -> Option<Doubt> {
        let [away_s, most_s] = self.contradiction_s?;
        Some(Doubt::Parts {
            camera,
            away_s,
            most_s,
        })
    }
}

/// Compares the parts of a recording with the parts of another recording.
///
/// * `offset_s`: common offset; a time of the reference plus this offset is the time of the camera.
/// * `way_s`: travel time of sound from one camera to the other.
pub(super) fn parts(
    reference: &Beginnings,
    camera: &Beginnings,
    offset_s: f64,
    way_s: f64,
) -> Drift {
    let [from, to] = reference.span();
    let length = (PART_S / HOP_S) as i64;
    let mut points: Vec<[f64; 2]> = Vec::new();
    for begin in (from..to - length / 2).step_by(length as usize) {
        let span = [begin, (begin + length).min(to)];
        let found = reference.compare(camera, span, [offset_s, AROUND_S]);
        if found.n >= LEAST && found.cosine >= LEAST_COSINE && found.ratio() <= MOST_RATIO {
            let middle_s = 0.5 * (span[0] + span[1]) as f64 * HOP_S;
            points.push([middle_s + found.offset_s, -found.offset_s]);
        }
    }
    if points.len() < LEAST_PARTS {
        return Drift {
            line: None,
            contradiction_s: None,
        };
    }
    let most_s = 2.0 * way_s + SPARE_S;
    let slope = median(slopes(&points));
    let at_zero_s = median(points.iter().map(|point| point[1] - slope * point[0]).collect());
    let away_s = |point: &[f64; 2]| (point[1] - at_zero_s - slope * point[0]).abs();
    let mut far: Vec<f64> = points.iter().map(away_s).filter(|value| *value > most_s).collect();
    let too_many = far.len() as f64 > MOST_AWAY * points.len() as f64;
    far.sort_by(f64::total_cmp);
    let contradiction_s = far.last().filter(|_| too_many).map(|far| [*far, most_s]);
    points.retain(|point| away_s(point) <= most_s);
    Drift {
        line: fitted(&points),
        contradiction_s,
    }
}

/// Returns the slopes between all pairs of points.
fn slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let mut slopes = Vec::new();
    for (nth, a) in points.iter().enumerate() {
        slopes.extend(points[nth + 1..].iter().map(|b| (b[1] - a[1]) / (b[0] - a[0])));
    }
    slopes
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Fits a line by least squares.
fn fitted(points: &[[f64; 2]]) -> Option<Line> {
    if points.len() < LEAST_PARTS {
        return None;
    }
    let n = points.len() as f64;
    let [x, y] = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|point| (point[0] - x).powi(2)).sum();
    let slope = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum::<f64>() / spread;
    let at_zero_s = y - slope * x;
    let residuals = points.iter().map(|point| (point[1] - at_zero_s - slope * point[0]).powi(2));
    let variance = (residuals.sum::<f64>() / (n - 2.0)).max(HEARD_S.powi(2));
    let ends = points.iter().map(|point| point[0]);
    let [first, last] = [
        ends.clone().fold(f64::INFINITY, f64::min),
        ends.fold(f64::NEG_INFINITY, f64::max),
    ];
    Some(Line {
        at_zero_s,
        slope,
        error: (variance / spread).sqrt(),
        length_s: last - first,
    })
}
