//! What ONNX Runtime runs a network on.

use serde::{Deserialize, Serialize};

/// What a network runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// One thread of the processor.
    #[default]
    Cpu,
    /// The first GPU of NVIDIA's, which the library must have been built for.
    Cuda,
}
