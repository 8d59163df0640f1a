//! Offsets between clocks from the sounds that all cameras recorded. This is an alternative if people are not seen well.
//!
//! Sounds begin suddenly, and all microphones record these beginnings. The offset between two clocks is the offset at which the largest
//! number of beginnings coincides. Sound takes 2.9 ms per metre, and the positions of its sources are unknown; this limits the accuracy.

mod beginnings;
mod parts;

#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector, Point3};

use crate::synchronisation::curve::Curve;
use crate::synchronisation::doubt::Doubt;
use crate::synchronisation::estimate::{CameraClock, Outcome, PairReport, check_settings};
use crate::synchronisation::film::FilmError;
use beginnings::{Beginnings, HOP_S, Match};
use parts::parts;

/// Speed of sound in air at 20 degrees Celsius, in metres per second.
const SPEED_M_S: f64 = 343.0;
/// Assumed largest distance between two cameras if it is unknown, in metres.
const FAR_M: f64 = 10.0;
/// Standard error of the time at which a sound begins, in seconds.
const HEARD_S: f64 = 0.002;
/// Minimum number of beginnings that two cameras share.
const LEAST: usize = 3;
/// Smallest accepted cosine between the beginnings of two cameras.
const LEAST_COSINE: f64 = 0.2;
/// Minimum difference between the cosine at the best offset and the mean cosine over all offsets, in standard deviations of the cosines.
const LEAST_CONTRAST: f64 = 8.0;
/// Largest accepted cosine at the second-best offset, as a fraction of the cosine at the best.
const MOST_RATIO: f64 = 0.75;
/// Largest accepted difference between the offsets of pairs, in addition to the travel time of sound, in seconds.
const SPARE_S: f64 = 0.01;
/// Length of the part of the recording in which all offsets are tried, in seconds.
const SEARCHED_S: f64 = 60.0;

/// Recording from the microphone of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sound {
    /// Number of samples per second.
    pub rate_hz: f64,
    /// Time of the first sample, in seconds by the clock of the camera; the camera's first frame is at 0.
    pub begins_s: f64,
    /// The samples.
    pub samples: Vec<i16>,
}

/// Settings of the estimation of clocks from sounds.
#[derive(Debug, Clone, PartialEq)]
pub struct SoundSettings {
    /// Index of the camera whose clock is the common one.
    pub reference: usize,
    /// Largest offset between two cameras to search, in both directions, in seconds.
    pub window_s: f64,
    /// Positions of the cameras in metres, if known.
    pub centres: Option<Vec<Point3<f64>>>,
}

/// Estimates the clocks from sounds.
///
/// In the [`Outcome`], residuals are NaN, and `n` is the number of beginnings of sounds that a camera shares with other cameras. Costs are
/// one minus the cosine between the beginnings of two cameras.
///
/// * `sounds`: recordings of the cameras, in order.
///
/// # Errors
///
/// Fails with [`FilmError`] for fewer than two cameras, a reference that does not exist, or a window that is out of range.
pub fn estimate_by_sound(sounds: &[Sound], settings: &SoundSettings) -> Result<Outcome, FilmError> {
    check_settings(sounds.len(), settings.reference, settings.window_s)?;
    let heard: Vec<Beginnings> = sounds.iter().map(Beginnings::of).collect();
    Ok(Study { heard, settings }.outcome())
}

struct Study<'a> {
    heard: Vec<Beginnings>,
    settings: &'a SoundSettings,
}

/// Comparison of the sounds of two cameras.
struct Pair {
    cameras: [usize; 2],
    found: Match,
}

impl Pair {
    fn is_sure(&self) -> bool {
        self.found.n >= LEAST
            && self.found.cosine >= LEAST_COSINE
            && self.found.contrast >= LEAST_CONTRAST
            && self.found.ratio() <= MOST_RATIO
    }
}

impl Study<'_> {
    fn outcome(&self) -> Outcome {
        let n = self.heard.len();
        let mut pairs = Vec::new();
        for a in 0..n {
            for b in a + 1..n {
                let [of_a, of_b] = [&self.heard[a], &self.heard[b]];
                let span = of_a.loudest(of_b, SEARCHED_S);
                let found = of_a.compare(of_b, span, [0.0, self.settings.window_s]);
                let cameras = [a, b];
                pairs.push(Pair { cameras, found });
            }
        }
        let mut doubts = self.quiet();
        let offsets_s = self.offsets(&pairs);
        self.doubt(&pairs, &offsets_s, &mut doubts);
        let offsets_s: Vec<f64> =
            offsets_s.iter().map(|offsets_s| offsets_s.unwrap_or(0.0)).collect();
        let reference = self.settings.reference;
        let drifts: Vec<parts::Drift> = (0..n)
            .map(|camera| {
                let away_s = self.way_s([camera, reference]);
                let [of_camera, of_reference] = [&self.heard[camera], &self.heard[reference]];
                parts(of_reference, of_camera, -offsets_s[camera], away_s)
            })
            .collect();
        for (camera, drift) in drifts.iter().enumerate() {
            doubts.extend(drift.doubt(camera));
        }
        let length_s = self.heard.iter().map(Beginnings::length_s);
        let camera = |camera: usize| CameraClock {
            offset_s: drifts[camera].offset_s(offsets_s[camera]),
            error_s: self.error_s(camera),
            drift: drifts[camera].sure(),
            drift_error: drifts[camera].error(),
            n: shared(&pairs, camera),
            before_px: f64::NAN,
            after_px: f64::NAN,
        };
        let report = |pair: &Pair| PairReport {
            cameras: pair.cameras,
            offset_s: offsets_s[pair.cameras[0]] - offsets_s[pair.cameras[1]],
            best_s: pair.found.offset_s,
            second_s: pair.found.second_s,
            ratio: pair.found.ratio(),
            n: pair.found.n,
        };
        let ratios = pairs.iter().filter(|pair| pair.is_sure());
        Outcome {
            cameras: (0..n).map(camera).collect(),
            second_best: ratios.map(|ratio| ratio.found.ratio()).fold(0.0, f64::max),
            curves: pairs.iter().map(curve).collect(),
            doubts,
            length_s: length_s.fold(f64::INFINITY, f64::min),
            pairs: pairs.iter().map(report).collect(),
        }
    }

    /// Returns the travel time of sound from one camera to another, in seconds. The offset of a pair may be wrong by this time.
    fn way_s(&self, [a, b]: [usize; 2]) -> f64 {
        let far = self.settings.centres.as_ref().and_then(|all| {
            let metres = (all.get(a)? - all.get(b)?).norm();
            metres.is_finite().then_some(metres)
        });
        far.unwrap_or(if a == b { 0.0 } else { FAR_M }) / SPEED_M_S
    }

    /// Returns the standard error of the offset of a camera; any position of a source between the two is equally likely.
    fn error_s(&self, camera: usize) -> f64 {
        let reference = self.settings.reference;
        if camera == reference {
            return 0.0;
        }
        (self.way_s([camera, reference]) / 3.0_f64.sqrt()).hypot(HEARD_S)
    }

    /// Returns doubts about cameras that recorded too few sounds.
    fn quiet(&self) -> Vec<Doubt> {
        let each = self.heard.iter().enumerate();
        let quiet = each.filter(|(_, it)| it.n() < LEAST);
        let doubt = |(camera, it): (usize, &Beginnings)| Doubt::Quiet {
            camera,
            n: it.n(),
            least: LEAST,
        };
        quiet.map(doubt).collect()
    }

    /// Returns the offsets that best fit the pairs with a clear offset of their own; `None` for a camera that these pairs do not connect
    /// with the reference.
    fn offsets(&self, pairs: &[Pair]) -> Vec<Option<f64>> {
        let n = self.heard.len();
        let sure: Vec<&Pair> = pairs.iter().filter(|pair| pair.is_sure()).collect();
        let mut is_connected = vec![false; n];
        is_connected[self.settings.reference] = true;
        for _ in 0..n {
            for Pair {
                cameras: [a, b], ..
            } in &sure
            {
                let either = is_connected[*a] || is_connected[*b];
                (is_connected[*a], is_connected[*b]) = (either, either);
            }
        }
        // The offset of the reference is fixed at 0. A camera that no pair connects has an equation of its own.
        let mut normal = DMatrix::<f64>::zeros(n, n);
        let mut right = DVector::<f64>::zeros(n);
        for it in &sure {
            let [a, b] = it.cameras;
            let weight = self.way_s(it.cameras).hypot(HEARD_S).powi(-2);
            for (row, sign) in [(a, 1.0), (b, -1.0)] {
                normal[(row, a)] += weight * sign;
                normal[(row, b)] -= weight * sign;
                right[row] += weight * sign * it.found.offset_s;
            }
        }
        for (camera, is_connected) in is_connected.iter().enumerate() {
            if camera == self.settings.reference || !is_connected {
                normal[(camera, camera)] += 1e12;
            }
        }
        let solved = normal.cholesky().map(|cholesky| cholesky.solve(&right));
        let offset = |camera: usize| {
            let solved = solved.as_ref().filter(|_| is_connected[camera])?;
            Some(solved[camera] - solved[self.settings.reference])
        };
        (0..n).map(offset).collect()
    }

    /// Adds reasons not to use the offsets.
    fn doubt(&self, pairs: &[Pair], offsets_s: &[Option<f64>], doubts: &mut Vec<Doubt>) {
        for (camera, offset_s) in offsets_s.iter().enumerate() {
            if self.heard[camera].n() < LEAST {
                continue;
            }
            match offset_s {
                None => doubts.extend(best(pairs, camera).map(|pair| Doubt::Unheard {
                    cameras: pair.cameras,
                    n: pair.found.n,
                    least: LEAST,
                    cosine: pair.found.cosine,
                    least_cosine: LEAST_COSINE,
                    ratio: pair.found.ratio(),
                    most_ratio: MOST_RATIO,
                })),
                Some(offset_s) if offset_s.abs() >= self.settings.window_s - 2.0 * HOP_S => {
                    doubts.push(Doubt::Edge {
                        camera,
                        offset_s: *offset_s,
                        window_s: self.settings.window_s,
                    });
                }
                Some(_) => {}
            }
        }
        for it in pairs.iter().filter(|pair| pair.is_sure()) {
            let [a, b] = it.cameras;
            let Some((of_a, of_b)) = offsets_s[a].zip(offsets_s[b]) else {
                continue;
            };
            let away_s = it.found.offset_s - (of_a - of_b);
            let reference = self.settings.reference;
            let ways = [[a, b], [a, reference], [b, reference]].map(|pair| self.way_s(pair));
            let most_s = ways.iter().sum::<f64>() + SPARE_S;
            if away_s.abs() > most_s {
                doubts.push(Doubt::Heard {
                    cameras: it.cameras,
                    away_s,
                    most_s,
                });
            }
        }
    }
}

/// Returns the largest number of beginnings of sounds that a camera shares with another camera.
fn shared(pairs: &[Pair], camera: usize) -> usize {
    let own = pairs.iter().filter(|pair| pair.cameras.contains(&camera));
    own.map(|pair| pair.found.n).max().unwrap_or(0)
}

/// Returns the best-fitting pair that contains a camera.
fn best(pairs: &[Pair], camera: usize) -> Option<&Pair> {
    let own = pairs.iter().filter(|pair| pair.cameras.contains(&camera));
    own.max_by(|a, b| a.found.cosine.total_cmp(&b.found.cosine))
}

/// Returns the curve of a pair, for a plot.
fn curve(pair: &Pair) -> Curve {
    let cosines = &pair.found.cosines;
    let known = cosines.iter().filter(|cosine| cosine.is_finite());
    let mean = known.clone().sum::<f64>() / known.count().max(1) as f64;
    Curve {
        cameras: pair.cameras,
        step_s: HOP_S,
        first_s: pair.found.first_s,
        gain: cosines.iter().map(|cosine| cosine - mean).collect(),
        cost: cosines.iter().map(|cosine| 1.0 - cosine).collect(),
        n: vec![pair.found.n as f64; cosines.len()],
        samples: Vec::new(),
    }
}
