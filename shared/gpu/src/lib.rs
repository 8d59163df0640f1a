//! The paper's single-view search on a GPU: from the image to distinct poses, bounds and evidence.
//!
//! [`Device::open`] opens a GPU through Vulkan. A [`View`] searches the frames of one view on the GPU. The CPU ([`fmp::Extractor`] and
//! [`fmp::Solver`]) is the reference. The features are identical bit for bit. If the responses are equal, the poses, scores and bounds are
//! identical too. Responses are computed as plain sums with fused multiply-adds, as in [`fmp::Extractor::direct`]. Without the feature
//! `gpu` there is never a device.
#![deny(unsafe_code)]

mod adapter;
mod error;

#[cfg(feature = "gpu")]
mod device;
#[cfg(feature = "gpu")]
mod dispatch;
#[cfg(feature = "gpu")]
mod expand;
#[cfg(feature = "gpu")]
mod group;
#[cfg(feature = "gpu")]
mod open;
#[cfg(feature = "gpu")]
mod picture;
#[cfg(feature = "gpu")]
mod programs;
#[cfg(feature = "gpu")]
mod spirv;
#[cfg(feature = "gpu")]
mod suits;
#[cfg(feature = "gpu")]
mod tree;
#[cfg(feature = "gpu")]
mod view;

#[cfg(not(feature = "gpu"))]
mod absent;

pub use adapter::{Adapter, Choice, Kind};
pub use error::{DeviceLost, OpenError, Unsuitable};

#[cfg(not(feature = "gpu"))]
pub use absent::{Device, View, adapters};
#[cfg(feature = "gpu")]
pub use device::Device;
#[cfg(feature = "gpu")]
pub use open::adapters;
#[cfg(feature = "gpu")]
pub use view::View;

/// True if this build supports GPUs.
pub const IS_BUILT: bool = cfg!(feature = "gpu");

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Distinct poses, best first.
    pub candidates: Vec<fmp::Pose>,
    /// Upper bounds of the scores, for every level.
    pub bounds: fmp::Bounds,
}

/// Limits for the poses in a result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Maximum number of poses.
    pub n: usize,
    /// Smallest mean distance between the part centres of two poses, in box sides; see [`fmp::Solver::distinct`].
    pub min_separation: f64,
}
