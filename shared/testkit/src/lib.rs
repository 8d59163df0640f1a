//! Helpers for tests only.
#![forbid(unsafe_code)]

pub mod browser;
pub mod c3d;
pub mod chromium;
pub mod exif;
pub mod mat;
pub mod networks;
pub mod npy;
