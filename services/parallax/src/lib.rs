//! The file-to-file work behind the commands for rigs and finished runs.
#![forbid(unsafe_code)]

pub mod boards;
