//! Cameras calibrated from what they see.
//!
//! Everything that is found is found by one adjustment of all unknowns at once, [`geometry::bundle`]; what is here makes a start
//! for it, says what the terms are, and judges what came out. Pure: no clock, file or thread.
#![forbid(unsafe_code)]

pub mod board;
pub mod origin;
