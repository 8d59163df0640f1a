//! Evaluation of a network on people whose direction is known.

use rayon::prelude::*;

use crate::orientation::detector::{Detector, Workspace};
use crate::orientation::train::Sample;

/// Measures how reliably a detector distinguishes a direction from the opposite one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Score {
    /// Number of people.
    pub n: usize,
    /// Number of people whose true direction is rated as more likely than the opposite one.
    pub n_right: usize,
    /// Mean negative log-likelihood in nats; `ln 2` for a detector that only guesses.
    pub surprise: f64,
}

impl Score {
    /// Share of people whose direction the detector finds, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.n_right as f64 / self.n.max(1) as f64
    }
}

/// Evaluates a detector on samples. It runs in parallel, with the same bits for any number of threads.
pub fn score(detector: &Detector, samples: &[Sample]) -> Score {
    let log_ratio = |workspace: &mut Workspace, sample: &Sample| {
        let evidence = detector.of_tile(&sample.tile, workspace);
        let [right, towards] = sample.front;
        // The direction is scaled to unit length in the picture plane, because photographs do not show the depth component.
        let length = right.hypot(towards).max(0.3);
        f64::from(2.0 * (evidence[0] * right + evidence[1] * towards) / length)
    };
    let ratios: Vec<f64> = samples.par_iter().map_init(Workspace::default, log_ratio).collect();
    let surprise: f64 = ratios.iter().map(|ratio| (-ratio).exp().ln_1p()).sum();
    Score {
        n: ratios.len(),
        n_right: ratios.iter().filter(|ratio| **ratio > 0.0).count(),
        surprise: surprise / ratios.len().max(1) as f64,
    }
}
