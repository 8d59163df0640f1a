//! A build without the feature `gpu`: there is no device.

use std::sync::Arc;

use fmp::{Layout, Model, Pose};
use kernels::Rgb8View;

use crate::{Adapter, Choice, DeviceLost, Found, OpenError, Unsuitable, Wanted};

/// A GPU; there is none in this build.
#[derive(Debug)]
pub enum Device {}

/// The search of one view on a GPU; there is none in this build.
#[derive(Debug)]
pub enum View {}

/// The adapters of this machine: none that this build could find.
pub fn adapters() -> Vec<Adapter> {
    Vec::new()
}

impl Device {
    /// Opens an adapter.
    ///
    /// # Errors
    ///
    /// Always [`OpenError::NotBuilt`].
    pub fn open(_choice: Choice) -> Result<Self, OpenError> {
        Err(OpenError::NotBuilt)
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        match *self {}
    }

    /// Gives the device up.
    pub fn destroy(&self) {
        match *self {}
    }
}

impl View {
    /// Prepares the search of a view.
    ///
    /// # Errors
    ///
    /// Never: there is no device.
    pub fn new(device: &Arc<Device>, _: Arc<Model>, _: Arc<Layout>) -> Result<Self, Unsuitable> {
        match **device {}
    }

    /// Searches an image.
    ///
    /// # Errors
    ///
    /// Never: there is no device.
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
