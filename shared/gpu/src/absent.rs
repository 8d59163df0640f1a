//! Replacement for the GPU code in a build without the feature `gpu`. In such a build, no device can be opened.

use std::sync::Arc;

use fmp::{Layout, Model, Pose};
use kernels::Rgb8View;

use crate::{Adapter, Choice, DeviceLost, Found, OpenError, Unsuitable, Wanted};

/// A GPU; this build has none.
#[derive(Debug)]
pub enum Device {}

/// The search of one view on a GPU; this build has none.
#[derive(Debug)]
pub enum View {}

/// Lists the adapters of this machine: none in this build.
pub fn adapters() -> Vec<Adapter> {
    Vec::new()
}

impl Device {
    /// Opens an adapter.
    ///
    /// # Errors
    ///
    /// Always fails with [`OpenError::NotBuilt`].
    pub fn open(_choice: Choice) -> Result<Self, OpenError> {
        Err(OpenError::NotBuilt)
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        match *self {}
    }

    /// Gives up the device.
    pub fn destroy(&self) {
        match *self {}
    }
}

impl View {
    /// Prepares the search of a view.
    ///
    /// # Errors
    ///
    /// Never fails, because there is no device to call it with.
    pub fn new(device: &Arc<Device>, _: Arc<Model>, _: Arc<Layout>) -> Result<Self, Unsuitable> {
        match **device {}
    }

    /// Searches an image.
    ///
    /// # Errors
    ///
    /// Never fails, because there is no device to call it with.
    pub fn search(
        &self,
        _image: Rgb8View<'_>,
        _wanted: Wanted,
        _levels: &dyn Fn(&[Pose]) -> Vec<u16>,
        _evidence: &mut [f32],
    ) -> Result<Found, DeviceLost> {
        match *self {}
    }
}
