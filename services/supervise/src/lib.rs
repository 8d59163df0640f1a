//! Starts the processes of a deployment, watches them, restarts them and stops them.
#![forbid(unsafe_code)]

mod plan;

mod event;
mod outcome;
mod stall;
mod watch;

mod supervisor;

pub use event::{Death, Event};
pub use outcome::{Counts, Outcome, ProcessOutcome, State};
pub use plan::{Plan, Policy, ProcessSpec, Role};
pub use supervisor::{SuperviseError, run};
