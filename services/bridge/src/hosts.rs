//! The messages between the hosts of a deployment and their interpretation: framing, clocks, order, counts. The module has no side effects.
//!
//! | what | where |
//! |---|---|
//! | a message of a view as bytes, checked | [`Packet`] |
//! | questions and answers between two hosts | [`Signal`], [`Hello`], [`Answer`] |
//! | offset of another host's clock from this host's clock, with a bound | [`Clock`] |
//! | the maps of a view as Gaussians, after its poses | [`Maps`] |
//! | messages that wait to be sent: the newest of every lane (topic of a view), with a limit on the number in transit | [`Outbox`] |
//! | the frame of the run to which a message belongs, and the treatment of frames without a message | [`Arrivals`] |
//! | check that two hosts have the same files | [`Fingerprint`] |
//!
//! This module uses no sockets, clocks or files. Only the other modules of `services/bridge` do.

mod arrivals;
mod clock;
mod fingerprint;
mod hello;
mod maps;
mod outbox;
mod packet;
mod signal;

pub use arrivals::{Arrivals, Gap, Grid, Place, Tally};
pub use clock::{Clock, Estimate, Exchange, ExchangeError};
pub use fingerprint::{Difference, Fingerprint};
pub use hello::{Answer, Hello, HelloError, Welcome};
pub use maps::{Gaussian, MOST_GAUSSIANS, Maps, MapsError, PersonGaussians};
pub use outbox::{Outbox, Parcel, Sent};
pub use packet::{Content, Expected, HEAD_BYTES, Head, Packet, PacketError};
pub use signal::{Signal, SignalError};

/// Version of the messages in this module. Two hosts with different versions do not work together.
pub const VERSION: u16 = 2;
