//! The base of every program: exit codes, errors with hints, the stop request, log lines, progress, and the set-up of the
//! process. This crate does not contain the transport.

mod claim;
mod clock;
mod command;
mod console;
mod failure;
mod guard;
mod input;
mod interrupt;
mod log;
mod stop;
pub mod wording;

pub use claim::{Claim, check_claim};
pub use clock::{now_nanos, processor_nanos};
pub use command::{DEFECT, log_panics, panic_text, run_command};
pub use console::{Console, Silent};
pub use failure::{ExitKind, Failure, Fault, OrFail, require_results};
pub use guard::{end_process, guard_process};
pub use input::{in_file, no_text, read_text};
pub use interrupt::{uninterrupted, unless_stopped};
pub use log::init_logging;
pub use stop::Stop;
