//! Helpers for tests only: readers and writers of the files of others, networks, pages as a browser lays them out.
#![forbid(unsafe_code)]

pub mod browser;
pub mod c3d;
pub mod chromium;
pub mod exif;
pub mod mat;
pub mod networks;
pub mod npy;
