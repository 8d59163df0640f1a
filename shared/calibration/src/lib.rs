//! Calibration of cameras from their pictures.
//!
//! Each calibration is one adjustment of all unknowns at once, by [`geometry::bundle`]. This crate finds the initial values, defines
//! the terms of the adjustment, and judges the result. It uses no clock, file or thread.
//!
//! | from | module |
//! |---|---|
//! | a board that is moved around | [`board`] |
//! | people walking about | [`people`] |
//! | an existing rig, and people | [`refine`] |
//! | a board on the floor, or three points | [`origin`]: floor and axes |
#![forbid(unsafe_code)]

mod align;
pub mod board;
pub mod boards;
pub mod origin;
pub mod people;
pub mod refine;
pub mod synchronisation;

pub use align::{Difference, Similarity, aligned, differences};
