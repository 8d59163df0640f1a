//! Sends the skeletons of a running deployment as datagrams, for programs that can do neither with Rust nor with Python.
//!
//! A program beside the deployment, which reads it as any other does (`client`): no process of the pipeline waits for it, and
//! what the receiver does not take is lost and counted. [`json_datagram`] and [`osc_datagrams`] are pure.

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

/// The largest datagram, bytes: one that crosses any network in one piece.
pub const MOST_BYTES: usize = 1400;
