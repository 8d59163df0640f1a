//! Computation of networks and their gradients: Rust, or `LibTorch`.

use crate::networks::lesson::{Cost, Lesson, Running, Shown};
use crate::networks::ops::Network;
use crate::networks::parameters::Parameter;
use crate::networks::settings::{Backend, Precision};

/// A backend and the precision of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Computer {
    pub(crate) backend: Backend,
    pub(crate) precision: Precision,
}

impl Computer {
    /// Returns the outputs of a network for a batch.
    pub(crate) fn find(
        self,
        network: &impl Network,
        parameters: &[Parameter],
        shown: &Shown,
    ) -> Vec<Vec<f32>> {
        match self.backend {
            Backend::BuiltIn => crate::networks::reference::find(network, parameters, shown),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => {
                crate::networks::torch::find(network, parameters, (shown, self.precision))
            }
        }
    }

    /// Returns the gradients of the cost of a batch.
    ///
    /// * `cost`: computes the gradients of the cost from the outputs of the network.
    pub(crate) fn learn(
        self,
        network: &impl Network,
        running: Running<'_>,
        shown: &Shown,
        cost: &mut Cost<'_>,
    ) -> Lesson {
        match self.backend {
            Backend::BuiltIn => crate::networks::reference::learn(network, running, shown, cost),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => {
                crate::networks::torch::learn(network, running, (shown, self.precision), cost)
            }
        }
    }
}
