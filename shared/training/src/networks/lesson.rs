//! Inputs of a network in training, and the resulting gradients.

use fastrand::Rng;

use crate::networks::parameters::Parameter;

/// Returns the gradients of a cost with respect to the outputs of a network.
pub(crate) type Cost<'a> = dyn FnMut(&[Vec<f32>]) -> Vec<Vec<f32>> + 'a;

/// Inputs of a network for one batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shown {
    /// Number of samples in the batch.
    pub n: usize,
    /// Values of every input, in the order of [`Network::inputs`](crate::networks::Network::inputs).
    pub inputs: Vec<Vec<f32>>,
}

/// A network that is being trained.
#[derive(Debug, Clone)]
pub(crate) struct Running<'a> {
    pub(crate) parameters: &'a [Parameter],
    /// For every parameter, true if its gradient is requested.
    pub(crate) learned: &'a [bool],
    /// Random generator for dropout.
    pub(crate) dice: Rng,
}

/// Mean and variance of every channel of a batch, at one normalisation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statistics {
    /// Index of the parameter that contains the running mean. The next parameter contains the variance.
    pub(crate) at: usize,
    pub(crate) mean: Vec<f32>,
    pub(crate) variance: Vec<f32>,
}

/// Gradients and statistics of a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lesson {
    /// Gradient of every parameter; `None` for parameters that are not trained.
    pub(crate) gradients: Vec<Option<Vec<f32>>>,
    pub(crate) statistics: Vec<Statistics>,
}
