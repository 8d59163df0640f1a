//! How the programs speak with who runs them: data on standard output, messages and progress on standard error, the options of
//! all commands, exit codes in `--help`, completions and manual pages.
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
