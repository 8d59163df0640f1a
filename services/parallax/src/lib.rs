//! The computations of those commands that process the files of rigs and finished runs.
#![forbid(unsafe_code)]

pub mod boards;
