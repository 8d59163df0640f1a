//! Helpers for tests: readers and writers for files of other programs, small networks, and page layout in a browser.
#![forbid(unsafe_code)]

pub mod browser;
pub mod c3d;
pub mod chromium;
pub mod exif;
pub mod mat;
pub mod networks;
pub mod npy;
