//! Work from files to files behind the commands for rigs and finished runs.
#![forbid(unsafe_code)]

pub mod boards;
