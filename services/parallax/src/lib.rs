//! The computations behind the commands that read files and write files, for rigs and finished runs.
#![forbid(unsafe_code)]

pub mod boards;
