//! Cameras calibrated from what they see.
//!
//! Everything that is found is found by one adjustment of all unknowns at once, [`geometry::bundle`]; what is here makes a start
//! for it, says what the terms are, and judges what came out. Pure: no clock, file or thread.
//!
//! | from | module |
//! |---|---|
//! | a board that is moved around | [`board`] |
//! | people walking about | [`people`] |
//! | a rig that is there, and people | [`refine`] |
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
