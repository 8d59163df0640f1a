//! Input and output of the command-line programs.
//!
//! Data is written to standard output; messages and progress are written to standard error. This crate also has the options of all
//! commands, the exit codes in `--help`, completions, and manual pages.
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
