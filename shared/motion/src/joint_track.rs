//! State of one joint while its track is smoothed.

use crate::noise::{Noise, Prior};
use crate::rts::{self, Known, Usable};
use crate::track::{Absent, Estimate, Smoothed, State};
use crate::tune;

/// A joint during smoothing.
#[derive(Debug)]
pub(crate) struct Track {
    /// The measurement at every instant, if it can be used.
    pub(crate) used: Vec<Usable>,
    /// For every instant, true if the measurement comes from the same joint on the other side of the body.
    pub(crate) is_exchanged: Vec<bool>,
    /// For every instant, true if there is a measurement.
    pub(crate) is_measured: Vec<bool>,
    pub(crate) noise: Noise,
    /// State estimated from all measurements, at every instant; `None` outside the continuous stretches of the track.
    pub(crate) known: Vec<Option<Known>>,
    /// Weights of the measurements.
    pub(crate) weights: Vec<f64>,
}

impl Track {
    pub(crate) fn new(used: Vec<Usable>) -> Self {
        let n = used.len();
        Self {
            is_measured: used.iter().map(Option::is_some).collect(),
            used,
            is_exchanged: vec![false; n],
            noise: Noise {
                jerk: 1.0,
                scale: 1.0,
            },
            known: vec![None; n],
            weights: vec![0.0; n],
        }
    }

    pub(crate) fn tuned(&self, times: &[f64], stretches: &[[usize; 2]], prior: Prior) -> Noise {
        let parts: Vec<(&[f64], &[Usable])> = stretches
            .iter()
            .map(|&[from, to]| (&times[from..to], &self.used[from..to]))
            .collect();
        tune::tune(&parts, prior)
    }

    /// Smooths every continuous stretch of the track.
    pub(crate) fn smooth(&mut self, times: &[f64], stretches: &[[usize; 2]]) {
        self.known.fill(None);
        self.weights.fill(0.0);
        for &[from, to] in stretches {
            let stretch = rts::smooth(&times[from..to], &self.used[from..to], self.noise);
            for (at, known) in (from..to).zip(stretch.known) {
                self.known[at] = Some(known);
            }
            self.weights[from..to].copy_from_slice(&stretch.weights);
        }
    }

    pub(crate) fn known_noise(&self) -> Option<Noise> {
        let is_any = self.known.iter().any(Option::is_some);
        is_any.then_some(self.noise)
    }

    /// Returns the positions, with short gaps filled.
    pub(crate) fn filled(&self, times: &[f64], fill_s: f64) -> Vec<Smoothed> {
        let absent = |at: usize| {
            let is_measured = self.is_measured[at];
            Err(if is_measured {
                Absent::Rejected
            } else {
                Absent::Gap
            })
        };
        let mut all: Vec<Smoothed> = (0..times.len()).map(absent).collect();
        let mut last: Option<usize> = None;
        for at in (0..times.len()).filter(|&at| self.weights[at] > 0.0) {
            let is_near = |from: usize| times[at] - times[from] <= fill_s;
            if let Some(from) = last.filter(|&from| is_near(from)) {
                let gap = all.iter_mut().enumerate().take(at).skip(from + 1);
                for (between, place) in gap {
                    let is_measured = self.is_measured[between];
                    let state = if is_measured {
                        State::Rejected
                    } else {
                        State::Filled
                    };
                    self.put(place, [between, from], state);
                }
            }
            let state = if self.is_exchanged[at] {
                State::Exchanged
            } else {
                State::Measured
            };
            self.put(&mut all[at], [at, at], state);
            last = Some(at);
        }
        all
    }

    /// Sets the estimate at an instant.
    ///
    /// If the covariances are larger than the observed variation, the rest of the error may vary too slowly to be observed. Smoothing does
    /// not reduce that part.
    ///
    /// * `measured`: the instant of the measurement with this covariance.
    fn put(&self, place: &mut Smoothed, [at, measured]: [usize; 2], state: State) {
        if let Some((known, (_, own))) = self.known[at].zip(self.used[measured]) {
            let slow = (1.0 - self.noise.scale).max(0.0);
            *place = Ok(Estimate {
                position: known.position,
                covariance: Some(known.covariance * self.noise.scale + own * slow),
                state,
            });
        }
    }
}
