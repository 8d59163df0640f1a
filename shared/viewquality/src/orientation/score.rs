//! How often a network is right about people whose direction is known.

use rayon::prelude::*;

use crate::orientation::detector::{Detector, Workspace};
use crate::orientation::train::Sample;

/// How often a detector distinguishes a direction from its opposite.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Score {
    /// People.
    pub n: usize,
    /// Those whose true direction is the more likely one.
    pub n_right: usize,
    /// Mean surprise, nats; `ln 2` for a detector that says nothing.
    pub surprise: f64,
}

impl Score {
    /// Share that is right, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.n_right as f64 / self.n.max(1) as f64
    }
}

/// Scores a detector on samples; in parallel, the same bits on any number of threads.
pub fn score(detector: &Detector, samples: &[Sample]) -> Score {
    let log_ratio = |workspace: &mut Workspace, sample: &Sample| {
        let evidence = detector.of_tile(&sample.tile, workspace);
        let [right, towards] = sample.front;
        // Of unit length in the picture: the direction out of it is not known of photographs.
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
