//! Where ONNX Runtime runs networks.

use core::fmt;

/// Where ONNX Runtime runs networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Provider {
    /// On one thread of the processor.
    Processor,
    /// On the first GPU of NVIDIA's, which the library must have been built for: else no network can be loaded.
    Cuda,
    /// The same, or on the processor where CUDA cannot start.
    CudaIfItStarts,
}

impl Provider {
    /// Returns true if CUDA is tried.
    pub fn is_cuda(self) -> bool {
        self != Self::Processor
    }
}

/// Where ONNX Runtime runs a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// On one thread of the processor, as requested.
    Processor,
    /// On the first GPU of NVIDIA's.
    Cuda,
    /// On the processor, since CUDA cannot start; the reason.
    ProcessorForCuda(String),
}

impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Processor => to.write_str("the processor"),
            Self::Cuda => to.write_str("CUDA"),
            Self::ProcessorForCuda(why) => {
                write!(to, "the processor, since CUDA cannot start: {why}")
            }
        }
    }
}
