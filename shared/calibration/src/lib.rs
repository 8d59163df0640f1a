//! Cameras calibrated from what they see.
//!
//! Everything that is found is found by one adjustment of all unknowns at once, [`geometry::bundle`]; what is here makes a start
//! for it, says what the terms are, and judges what came out. Pure: no clock, file or thread.
//!
//! | from | module |
//! |---|---|
//! | people walking about | [`people`] |
//! | a rig that is there, and people | [`refine`] |
#![forbid(unsafe_code)]

mod align;
mod median;

pub mod people;

pub mod refine;

pub use align::{Difference, Similarity, aligned, differences};
