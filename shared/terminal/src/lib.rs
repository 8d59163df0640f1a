//! Input and output of the programs on the command line.
//!
//! Data are written to standard output, messages and progress to standard error. This crate also has the options of all commands,
//! the exit codes in `--help`, completions, and manual pages.
#![forbid(unsafe_code)]

pub mod completions;
pub mod output;

mod exit;
mod globals;
mod terminal;
mod values;

pub use exit::EXIT_CODES;
pub use globals::Globals;
pub use terminal::Terminal;
pub use values::{Outline, outline, rate};
