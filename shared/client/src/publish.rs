//! Sends the skeletons of a running deployment as datagrams, for programs that can use neither Rust nor Python.
//!
//! The publisher is a separate program, which reads the deployment as any client does. No process of the pipeline waits for it.
//! Datagrams that the receiver does not take are lost and counted. [`json_datagram`] and [`osc_datagrams`] are pure functions.

mod beside;
mod frame;
mod json;
mod osc;
mod send;
mod target;

pub use beside::Companion;
pub use frame::{Frame, Place};
pub use json::{json_datagram, json_names};
pub use osc::osc_datagrams;
pub use send::{Counts, run};
pub use target::{Form, Target, TargetError};

/// Maximum size of a datagram, in bytes. A datagram of this size crosses any network in one piece.
pub const MOST_BYTES: usize = 1400;
