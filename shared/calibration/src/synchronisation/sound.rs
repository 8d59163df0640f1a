//! Offsets between clocks from the sounds that all cameras recorded: a second way, where people are not seen well.
//!
//! Sounds begin suddenly, and all microphones hear them begin. The offset between two clocks is where most beginnings fall together.
//! Sound needs 2.9 ms for a metre, and where its sources were is not known: that is the error.

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

/// Speed of sound in air of 20 degrees, metres a second.
const SPEED_M_S: f64 = 343.0;
/// How far two cameras are apart at most where that is not known, metres.
const FAR_M: f64 = 10.0;
/// Error of the time at which a sound is heard to begin, seconds.
const HEARD_S: f64 = 0.002;
/// Least beginnings that two cameras share.
const LEAST: usize = 3;
/// Least cosine between the beginnings of two cameras.
const LEAST_COSINE: f64 = 0.2;
/// By how many standard deviations over all offsets the best one is better than their mean, at least.
const LEAST_CONTRAST: f64 = 8.0;
/// How good the second best offset may be, as a share of the best.
const MOST_RATIO: f64 = 0.75;
/// Largest contradiction between pairs beside the way of the sound, seconds.
const SPARE_S: f64 = 0.01;
/// Length of the part that is searched in full, seconds.
const SEARCHED_S: f64 = 60.0;

/// Recording of the microphone of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sound {
    /// Samples a second.
    pub rate_hz: f64,
    /// Time of the first sample, seconds by the clock of the camera: its first frame is at 0.
    pub begins_s: f64,
    /// The samples.
    pub samples: Vec<i16>,
}

/// How clocks are estimated from sounds.
#[derive(Debug, Clone, PartialEq)]
pub struct SoundSettings {
    /// The camera whose clock is the common one, by its place in the list.
    pub reference: usize,
    /// Offsets between two cameras are searched up to this, both ways, seconds.
    pub window_s: f64,
    /// Where the cameras stand, metres, where that is known.
    pub centres: Option<Vec<Point3<f64>>>,
}

/// Estimates the clocks.
///
/// In the [`Outcome`] residuals are not numbers, `n` counts beginnings of sounds that a camera shares with others, and costs are one
/// less the cosine between the beginnings of two cameras.
///
/// * `sounds`: what the cameras recorded, in their order.
///
/// # Errors
///
/// [`FilmError`]: fewer than two cameras, a reference that does not exist, a window that makes no sense.
pub fn estimate_by_sound(sounds: &[Sound], settings: &SoundSettings) -> Result<Outcome, FilmError> {
    check_settings(sounds.len(), settings.reference, settings.window_s)?;
    let heard: Vec<Beginnings> = sounds.iter().map(Beginnings::of).collect();
    Ok(Study { heard, settings }.outcome())
}

struct Study<'a> {
    heard: Vec<Beginnings>,
    settings: &'a SoundSettings,
}

/// Sounds that two cameras heard together.
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

    /// How long sound takes from one camera to another, seconds: by so much the offset of a pair may be wrong.
    fn way_s(&self, [a, b]: [usize; 2]) -> f64 {
        let far = self.settings.centres.as_ref().and_then(|all| {
            let metres = (all.get(a)? - all.get(b)?).norm();
            metres.is_finite().then_some(metres)
        });
        far.unwrap_or(if a == b { 0.0 } else { FAR_M }) / SPEED_M_S
    }

    /// Standard error of the offset of a camera: any source between the two is as likely.
    fn error_s(&self, camera: usize) -> f64 {
        let reference = self.settings.reference;
        if camera == reference {
            return 0.0;
        }
        (self.way_s([camera, reference]) / 3.0_f64.sqrt()).hypot(HEARD_S)
    }

    /// Cameras that heard too little.
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

    /// The offsets that fit the pairs best which are sure by themselves; none for a camera that these do not connect with the
    /// reference.
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
        // The reference is held at 0; a camera that is not connected has an equation of its own.
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

/// Beginnings that a camera shares with the one with which it shares most.
fn shared(pairs: &[Pair], camera: usize) -> usize {
    let own = pairs.iter().filter(|pair| pair.cameras.contains(&camera));
    own.map(|pair| pair.found.n).max().unwrap_or(0)
}

/// The pair of a camera that fits best.
fn best(pairs: &[Pair], camera: usize) -> Option<&Pair> {
    let own = pairs.iter().filter(|pair| pair.cameras.contains(&camera));
    own.max_by(|a, b| a.found.cosine.total_cmp(&b.found.cosine))
}

/// The curve of a pair, for a plot.
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
