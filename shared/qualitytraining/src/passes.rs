//! What the passes of a training came to.

use serde::{Deserialize, Serialize};

/// The results of one pass over the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Mean training loss.
    pub learnt: f32,
    /// Mean validation loss after the pass.
    pub validated: f32,
    /// Mean area under the ROC of the validation samples.
    pub area: f64,
}
