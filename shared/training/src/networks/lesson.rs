//! What a network is shown while it is trained, and what follows from it.

use fastrand::Rng;

use crate::networks::parameters::Parameter;

/// Returns the gradients of a cost by the outputs of a network.
pub(crate) type Cost<'a> = dyn FnMut(&[Vec<f32>]) -> Vec<Vec<f32>> + 'a;

/// What a network is shown: a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shown {
    /// Samples.
    pub n: usize,
    /// The numbers of every input, in the order of [`Network::inputs`](crate::networks::Network::inputs).
    pub inputs: Vec<Vec<f32>>,
}

/// A network that is being trained.
#[derive(Debug, Clone)]
pub(crate) struct Running<'a> {
    pub(crate) parameters: &'a [Parameter],
    /// Of every parameter, whether its gradient is wanted.
    pub(crate) learned: &'a [bool],
    /// For dropout.
    pub(crate) dice: Rng,
}

/// Mean and variance of every channel of a batch where it was normalised.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statistics {
    /// The parameter that holds the running mean; the variance follows it.
    pub(crate) at: usize,
    pub(crate) mean: Vec<f32>,
    pub(crate) variance: Vec<f32>,
}

/// What follows from a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lesson {
    /// Of every parameter; nothing of those that are not learned.
    pub(crate) gradients: Vec<Option<Vec<f32>>>,
    pub(crate) statistics: Vec<Statistics>,
}
