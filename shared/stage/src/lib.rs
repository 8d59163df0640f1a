//! The main loop of every service: wait, receive, check, join, compute, send, record latencies, end.
//!
//! A service declares its inputs and outputs on a [`Stage`] and provides the step that turns one frame into messages. The
//! stage decides when a frame is complete, handles late messages and the end of streams, and ends the process. Every
//! message is checked and decoded once, when it is received.
//!
//! | input | method | a frame waits for it |
//! |---|---|---|
//! | one sender for each view | [`Stage::view_input`] | yes |
//! | one sender for several slots: a worker and its pairs | [`Stage::pair_inputs`] | yes |
//! | optional: expected errors | [`Stage::optional_input`] | until a deadline; after that, the last value is used unless it is too old |
//! | bulk data, read in shared memory | [`Stage::hold_evidence`], [`Stage::hold_frames`] | no |
//! | a stream of bulk data, with one sample for each frame | [`Stage::run_stream`] | - |
//!
//! A service that creates its own frames has no input and uses [`Stage::wait_for_receivers`] and [`Stage::end_with`]. A service that
//! handles each message as soon as it is received uses a [`Port`] for each topic, or an [`any::Receiver`] for messages as bytes.
#![forbid(unsafe_code)]

pub mod any;
mod context;
mod frame;
mod held;
mod inbox;
mod input;
mod intake;
pub mod join;
mod joins;
mod message;
mod output;
mod port;
mod receivers;
mod shelf;
mod slots;
mod stage;
mod stream;
mod thread;

pub use context::{Account, Context};
pub use frame::{Frame, Item, Turn};
pub use held::Held;
pub use message::Stamped;
pub use output::Output;
pub use port::{Port, Receive, Sender};
pub use shelf::HELD_REALTIME;
pub use stage::Stage;
pub use stream::{Range, StreamFrame};
pub use thread::WriterThread;
