//! Reasons why a GPU is missing or was lost.

/// Reason why no device could be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The feature `gpu` is off.
    #[error("this Parallax was built without GPU support: build it with --features gpu")]
    NotBuilt,
    /// Vulkan is missing or has no adapter.
    #[error("no Vulkan adapter was found")]
    NoAdapter,
    /// All adapters are programs that compute on the processor.
    #[error("the only Vulkan adapter is {name}, which computes on the processor")]
    OnlySoftware {
        /// Name of the best such adapter.
        name: String,
    },
    /// The adapter cannot be used.
    #[error("{name} cannot be used: {why}")]
    Refused {
        /// Name of the adapter.
        name: String,
        /// The reason: a missing property, or the message of the driver.
        why: String,
    },
}

/// Reason why a device cannot search a view.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unsuitable {
    /// The model has a property that the kernels do not support.
    #[error("the model has {what}, which the GPU does not support")]
    Model {
        /// The unsupported property.
        what: &'static str,
    },
    /// The device is too small.
    #[error("the GPU has a limit of {has} {what}, but {needed} are needed")]
    TooSmall {
        /// Unit and purpose of both numbers.
        what: &'static str,
        /// The number needed.
        needed: u64,
        /// The limit of the device.
        has: u64,
    },
    /// The driver does not accept the kernels.
    #[error("the driver rejects the kernels: {why}")]
    Refused {
        /// The message of the driver.
        why: String,
    },
}

/// The device no longer responds, or did not respond in time. It gives no further results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the connection to the GPU was lost")]
pub struct DeviceLost;
