//! Why there is no GPU, or no longer.

/// Why no device could be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The feature `gpu` is off.
    #[error("this build has no GPU support: build it with --features gpu")]
    NotBuilt,
    /// There is no Vulkan, or it has no adapter.
    #[error("no Vulkan adapter was found")]
    NoAdapter,
    /// All adapters are programs that compute on the processor.
    #[error("the only Vulkan adapter is software: {name}")]
    OnlySoftware {
        /// Its name.
        name: String,
    },
    /// The adapter cannot be used.
    #[error("{name} cannot be used: {why}")]
    Refused {
        /// Its name.
        name: String,
        /// The reason: something that it lacks, or the words of its driver.
        why: String,
    },
}

/// Why a device cannot search a view.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unsuitable {
    /// Something the kernels are not written for.
    #[error("the model has {what}, which the GPU does not support")]
    Model {
        /// The property that is in the way.
        what: &'static str,
    },
    /// The device is too small.
    #[error("{what} needs {needed}, the GPU has {has}")]
    TooSmall {
        /// The thing that needs it.
        what: &'static str,
        /// The number needed, in the unit of `what`.
        needed: u64,
        /// The number that the device has.
        has: u64,
    },
    /// The driver does not take the kernels.
    #[error("the driver refuses the kernels: {why}")]
    Refused {
        /// The words of the driver.
        why: String,
    },
}

/// The device no longer answers, or not in time: it gives no further results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the GPU was lost")]
pub struct DeviceLost;
