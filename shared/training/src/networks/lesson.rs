//! Inputs of a network in training, and the gradients that follow from them.

use fastrand::Rng;

use crate::networks::parameters::Parameter;

/// Returns the gradients of a cost by the outputs of a network.
pub(crate) type Cost<'a> = dyn FnMut(&[Vec<f32>]) -> Vec<Vec<f32>> + 'a;

/// Inputs of a network: a batch.
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
    /// For every parameter, true if its gradient is wanted.
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

/// Result of a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lesson {
    /// Gradient of every parameter; `None` for those that are not learned.
    pub(crate) gradients: Vec<Option<Vec<f32>>>,
    pub(crate) statistics: Vec<Statistics>,
}
