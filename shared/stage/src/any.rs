//! Topics of any message type, as bytes: what `record` receives and `replay` sends.

mod receiver;
mod sender;

pub use receiver::{Received, Receiver};
pub use sender::Sender;
