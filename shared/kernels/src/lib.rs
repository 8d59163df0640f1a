//! Grids, images and the hot loops, each loop written twice: once to be read, once to be fast.

mod image;

pub use image::{ImageSizeError, Rgb8View};
