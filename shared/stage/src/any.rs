//! Topics of any message type, as bytes. The service `record` receives such messages, and `replay` sends them.

mod receiver;
mod sender;

pub use receiver::{Received, Receiver};
pub use sender::Sender;
