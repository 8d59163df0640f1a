//! Minimisation of the cost, by the Levenberg-Marquardt method.

use super::equations::{Equations, cost};
use super::{Problem, Step};

/// Initial and maximum damping.
const DAMPING: [f64; 2] = [1e-4, 1e12];
/// Minimum damping, which keeps undetermined parameters near their values.
const LEAST_DAMPING: f64 = 1e-12;

/// Conditions that end the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum number of iterations.
    pub max_iterations: usize,
    /// The search ends if an iteration decreases the cost by less than this fraction.
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

/// Reason why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// The cost no longer decreases.
    Converged,
    /// No step, however short, lowers the cost: the minimum is reached to working precision.
    NoDescent,
    /// The maximum number of iterations was reached.
    Iterations,
    /// The cost at the start is not finite.
    NotFinite,
}

/// Report of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Number of steps taken.
    pub iterations: usize,
    /// Cost at the start.
    pub cost_before: f64,
    /// Cost at the end.
    pub cost_after: f64,
    /// Number of residuals, including priors.
    pub n_residuals: usize,
    /// Number of unknowns, shared and local.
    pub n_unknowns: usize,
    /// Reason why the search ended.
    pub stopped: Stopped,
}

impl Report {
    /// Returns true if a minimum was found.
    pub fn is_converged(&self) -> bool {
        matches!(self.stopped, Stopped::Converged | Stopped::NoDescent)
    }

    /// Returns the variance of a residual, if the standard deviations of all terms are correct relative to each other: cost divided by
    /// degrees of freedom. It is 1 if the standard deviations are correct.
    pub fn variance(&self) -> f64 {
        let freedom = self.n_residuals.saturating_sub(self.n_unknowns).max(1);
        self.cost_after / freedom as f64
    }
}

/// Minimises the cost near the current values (Levenberg-Marquardt method, damping after Nielsen 1999).
///
/// The weights of losses other than least squares are computed again at every step. A parameter that is not determined stays near its
/// initial value; use [`covariance`](super::covariance) to find out whether all are determined.
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

/// Returns a step that lowers the cost: the resulting problem, its cost, and the gain relative to the prediction.
fn tried<P: Problem>(at: &P, equations: &Equations, damping: f64) -> Option<(P, f64, f64)> {
    let step: Step = equations.step(damping)?;
    let promised = equations.gain(&step);
    let moved = at.moved(&step);
    let after = cost(&moved);
    // A comparison with NaN is false.
    let is_better = after < equations.cost;
    is_better.then(|| {
        let agreement = (equations.cost - after) / promised.max(f64::MIN_POSITIVE);
        (moved, after, agreement.min(1.0))
    })
}
