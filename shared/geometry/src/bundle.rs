//! Sparse bundle adjustment, for boards, for people, and for the refinement of rigs.
//!
//! The unknowns are a few *shared* parameters (cameras, time offsets, bone lengths) and many independent *local* blocks (a point, the
//! pose of a board, all joints of one frame), each with a dimension of its own. Every [`Term`] depends on one local block and a few shared
//! parameters. The local blocks are eliminated one by one (Schur complement), so that the time grows linearly with their number.
//!
//! | what | where |
//! |---|---|
//! | definition of a problem | [`Problem`], [`Term`], [`Loss`] |
//! | cameras of a problem, with free or fixed poses, focal lengths, centres and lenses | [`Cameras`], [`Free`] |
//! | minimisation of the cost, by the Levenberg-Marquardt method | [`solve`], [`Settings`], [`Report`] |
//! | uncertainty of the shared parameters, and parameters that are not determined | [`covariance`], [`clustered`], [`Undetermined`] |
//! | comparison of derivatives with numeric derivatives, for tests | [`derivative_error`] |
//!
//! Values that are fixed, such as the pose of the first camera (the gauge), are not parameters. A term without a local block fixes the
//! scale ([`Problem::priors`]). The functions are pure: the same input gives the same result, bit for bit.

mod cameras;
mod covariance;
mod derivatives;
mod equations;
mod solve;
mod term;

#[cfg(test)]
mod tests;

pub use cameras::{Cameras, Free, Observed};
pub use covariance::{Covariance, Undetermined, clustered, covariance};
pub use derivatives::derivative_error;
pub use solve::{Report, Settings, Stopped, solve};
pub use term::{Loss, Term};

/// A step of all unknowns, in coordinates defined by the problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Step of the shared parameters.
    pub shared: Vec<f64>,
    /// Step of every local block.
    pub locals: Vec<Vec<f64>>,
}

/// A sum of terms over shared parameters and local blocks, with the current values of all unknowns.
///
/// The problem stores its own values (rotations, points, lengths). The solver only handles steps and terms.
pub trait Problem: Sized {
    /// Returns the number of shared parameters.
    fn n_shared(&self) -> usize;

    /// Returns a readable name for a shared parameter.
    fn name(&self, parameter: usize) -> String;

    /// Returns the dimension of every local block.
    fn locals(&self) -> Vec<usize>;

    /// Passes every term of a local block to `take`, with residuals and derivatives at the current values.
    ///
    /// The number of terms and their order must not depend on the values.
    fn terms_of(&self, local: usize, take: &mut dyn FnMut(&Term));

    /// Passes the terms without a local block to `take`: the priors on shared parameters.
    fn priors(&self, take: &mut dyn FnMut(&Term));

    /// Returns the problem with all values moved by a step.
    #[must_use]
    fn moved(&self, step: &Step) -> Self;
}
