//! Messages between the hosts of a deployment, and their meaning there: framing, clocks, order, counts. Pure.
//!
//! | what | where |
//! |---|---|
//! | a message of a view as bytes, checked | [`Packet`] |
//! | questions and answers between two hosts | [`Signal`], [`Hello`], [`Answer`] |
//! | how far another host's clock is from ours, with a bound | [`Clock`] |
//! | the maps of a view as Gaussians, after its poses | [`Maps`] |
//! | what waits to be sent: the newest of every lane, and no more than a few on their way | [`Outbox`] |
//! | which frame of the run a message is for, and what became of the others | [`Arrivals`] |
//! | whether two hosts have the same files | [`Fingerprint`] |
//!
//! No socket, no clock and no file: `services/bridge` has those.

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

/// The version of everything here: two hosts with different ones do not talk.
pub const VERSION: u16 = 2;
