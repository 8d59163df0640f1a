//! What computes networks and their gradients: Rust, or `LibTorch`.

use fastrand::Rng;

use crate::ops::Network;
use crate::parameters::Parameter;
use crate::settings::{Backend, Precision};

/// What a network is shown: a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shown {
    /// Samples.
    pub n: usize,
    /// The numbers of every input, in the order of [`Network::inputs`].
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

/// What computes, and with which numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Computer {
    pub(crate) backend: Backend,
    pub(crate) precision: Precision,
}

impl Computer {
    /// The outputs of a network for a batch.
    pub(crate) fn find(
        self,
        network: &impl Network,
        parameters: &[Parameter],
        shown: &Shown,
    ) -> Vec<Vec<f32>> {
        match self.backend {
            Backend::BuiltIn => crate::reference::find(network, parameters, shown),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => crate::torch::find(network, parameters, (shown, self.precision)),
        }
    }

    /// The gradients of the cost of a batch.
    ///
    /// * `cost`: the gradients of the cost of the outputs that it is given.
    pub(crate) fn learn(
        self,
        network: &impl Network,
        running: Running<'_>,
        shown: &Shown,
        cost: &mut dyn FnMut(&[Vec<f32>]) -> Vec<Vec<f32>>,
    ) -> Lesson {
        match self.backend {
            Backend::BuiltIn => crate::reference::learn(network, running, shown, cost),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => {
                crate::torch::learn(network, running, (shown, self.precision), cost)
            }
        }
    }
}
