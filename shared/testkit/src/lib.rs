//! What only tests need.
#![forbid(unsafe_code)]

pub mod mat;
pub mod npy;
