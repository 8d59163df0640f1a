//! Records every message of a deployment in one file, and replays recorded messages ([`replay`]).
#![forbid(unsafe_code)]

mod foxglove;
mod onlooker;
mod queue;
pub mod replay;
mod sent;
mod service;
mod topics;
mod writer;

pub use foxglove::Stage;
pub use onlooker::{Kept, look_on};
pub use service::{Job, run};
pub use topics::Topics;
pub use writer::file_of_life;
