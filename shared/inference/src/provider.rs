//! Where ONNX Runtime runs networks.

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
    /// Says if CUDA is tried.
    pub fn is_cuda(self) -> bool {
        self != Self::Processor
    }
}
