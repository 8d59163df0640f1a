//! One sparse bundle adjustment, for boards, for people, and for rigs that are made better.
//!
//! The unknowns are an arrow: a few *shared* parameters (cameras, time offsets, lengths of bones), and many *local* blocks
//! (a point, the pose of a board, all joints of one frame), each of a dimension of its own, that know nothing of one another.
//! Every [`Term`] touches one local block and a few shared parameters. The local blocks are eliminated one by one (Schur
//! complement), so that the time grows with their number and not with its cube.
//!
//! | what | where |
//! |---|---|
//! | what a problem has to say of itself | [`Problem`], [`Term`], [`Loss`] |
//! | the cameras of a problem, with poses, focal lengths, centres and lenses that are free or held | [`Cameras`], [`Free`] |
//! | the least cost, by Levenberg and Marquardt's method | [`solve`], [`Settings`], [`Report`] |
//! | how well the shared parameters are known, and which are not | [`covariance`], [`clustered`], [`Undetermined`] |
//! | derivatives beside numeric ones, for tests | [`derivative_error`] |
//!
//! A parameter that is held (the gauge: the first camera, say) is no parameter: it is left out. Scale is held by a term
//! without a local block ([`Problem::priors`]). Pure; the same input gives the same bits.

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

/// A step of all unknowns, in the coordinates that the problem chose.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Step of the shared parameters.
    pub shared: Vec<f64>,
    /// Step of every local block.
    pub locals: Vec<Vec<f64>>,
}

/// A sum of terms over shared parameters and local blocks, with the present value of all of them.
///
/// The problem keeps its own values (rotations, points, lengths); the solver knows steps alone, and terms.
pub trait Problem: Sized {
    /// Number of shared parameters.
    fn n_shared(&self) -> usize;

    /// The name of a shared parameter, for people to read.
    fn name(&self, parameter: usize) -> String;

    /// The dimension of every local block.
    fn locals(&self) -> Vec<usize>;

    /// Hands over every term of a local block, with residuals and derivatives at the present values.
    ///
    /// The number of terms and their order do not depend on the values.
    fn terms_of(&self, local: usize, take: &mut dyn FnMut(&Term));

    /// Hands over the terms without a local block: what is known of the shared parameters beforehand.
    fn priors(&self, take: &mut dyn FnMut(&Term));

    /// The problem with all values moved by a step.
    #[must_use]
    fn moved(&self, step: &Step) -> Self;
}
