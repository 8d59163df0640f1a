//! The device on which ONNX Runtime runs networks.

use core::fmt;

/// Requested device for ONNX Runtime.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Provider {
    /// On one thread of the processor.
    Processor,
    /// On the first NVIDIA GPU. The library must have been built for it, otherwise no network can be loaded.
    Cuda,
    /// On the first NVIDIA GPU, or on the processor if CUDA cannot start.
    CudaIfItStarts,
}

impl Provider {
    /// Returns true if CUDA is requested.
    pub fn is_cuda(self) -> bool {
        self != Self::Processor
    }
}

/// Device on which ONNX Runtime actually runs a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// On one thread of the processor, as requested.
    Processor,
    /// On the first NVIDIA GPU.
    Cuda,
    /// On the processor because CUDA cannot start. The text is the reason.
    ProcessorForCuda(String),
}

impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Processor => to.write_str("the processor"),
            Self::Cuda => to.write_str("CUDA"),
            Self::ProcessorForCuda(why) => {
                write!(to, "the processor, because CUDA cannot start: {why}")
            }
        }
    }
}
