//! The least cost, by Levenberg and Marquardt's method.

use super::equations::{Equations, cost};
use super::{Problem, Step};

/// Damping at the start, and the most.
const DAMPING: [f64; 2] = [1e-4, 1e12];
/// The least damping, so that what is not determined stays near.
const LEAST_DAMPING: f64 = 1e-12;

/// When the search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The most iterations.
    pub max_iterations: usize,
    /// It ends where an iteration lowers the cost by less than this share of it.
    pub least_gain: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_iterations: 100,
            least_gain: 1e-9,
        }
    }
}

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// The cost does not become less any more.
    Converged,
    /// No step, however short, lowers the cost: at a minimum to working precision.
    NoDescent,
    /// So many iterations were not enough.
    Iterations,
    /// The cost at the start is not finite.
    NotFinite,
}

/// How the search went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Steps that were taken.
    pub iterations: usize,
    /// The cost at the start.
    pub cost_before: f64,
    /// The cost at the end.
    pub cost_after: f64,
    /// Number of residuals, priors among them.
    pub n_residuals: usize,
    /// Number of unknowns, shared and local.
    pub n_unknowns: usize,
    /// Why it ended.
    pub stopped: Stopped,
}

impl Report {
    /// Returns true if a minimum was found.
    pub fn is_converged(&self) -> bool {
        matches!(self.stopped, Stopped::Converged | Stopped::NoDescent)
    }

    /// Variance of a residual, if all terms of the problem are believed to be right about their shares of it: cost over
    /// degrees of freedom. 1 where the standard deviations of the terms are true.
    pub fn variance(&self) -> f64 {
        let freedom = self.n_residuals.saturating_sub(self.n_unknowns).max(1);
        self.cost_after / freedom as f64
    }
}

/// Finds the least cost near the present values (Levenberg and Marquardt's method, damping after Nielsen 1999).
///
/// Losses that are not squares are weighted anew at every step. Where something is not determined, it stays about where it
/// was: ask [`covariance`](super::covariance) whether all is.
pub fn solve<P: Problem>(start: P, settings: &Settings) -> (P, Report) {
    let mut at = start;
    let mut equations = Equations::new(&at);
    let n_locals: usize = at.locals().iter().sum();
    let mut report = Report {
        iterations: 0,
        cost_before: equations.cost,
        cost_after: equations.cost,
        n_residuals: equations.n_residuals,
        n_unknowns: at.n_shared() + n_locals,
        stopped: Stopped::Iterations,
    };
    if !equations.cost.is_finite() {
        report.stopped = Stopped::NotFinite;
        return (at, report);
    }
    let (mut damping, mut growth) = (DAMPING[0], 2.0);
    while report.iterations < settings.max_iterations {
        let Some((moved, after, agreement)) = tried(&at, &equations, damping) else {
            damping *= growth;
            growth *= 2.0;
            if damping > DAMPING[1] {
                report.stopped = Stopped::NoDescent;
                break;
            }
            continue;
        };
        let gain = equations.cost - after;
        at = moved;
        equations = Equations::new(&at);
        report.iterations += 1;
        report.cost_after = equations.cost;
        let shrink = 1.0 - (2.0 * agreement - 1.0).powi(3);
        damping = (damping * shrink.max(0.1)).max(LEAST_DAMPING);
        growth = 2.0;
        if gain <= settings.least_gain * equations.cost || equations.cost == 0.0 {
            report.stopped = Stopped::Converged;
            break;
        }
    }
    (at, report)
}

/// A step that lowers the cost: where it leads, the cost there, and the share of the gain that was promised.
fn tried<P: Problem>(at: &P, equations: &Equations, damping: f64) -> Option<(P, f64, f64)> {
    let step: Step = equations.step(damping)?;
    let promised = equations.gain(&step);
    let moved = at.moved(&step);
    let after = cost(&moved);
    // Comparison with NaN is false.
    let is_better = after < equations.cost;
    is_better.then(|| {
        let agreement = (equations.cost - after) / promised.max(f64::MIN_POSITIVE);
        (moved, after, agreement.min(1.0))
    })
}
