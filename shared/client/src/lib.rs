//! Read-only access to a running deployment, for your own programs.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use parallax_client::{Client, Wish};
//!
//! fn main() -> Result<(), parallax_client::ClientError> {
//!     let mut client = Client::open("demo", &Wish::skeletons())?;
//!     while let Some(moment) = client.next(Duration::from_secs(5))? {
//!         let Some(wrist) = moment.followed().and_then(|person| person.joint("right wrist")) else {
//!             continue;
//!         };
//!         match wrist.found {
//!             Ok(it) => println!("{:.3?} m, sure to {:.3} m", it.in_world, it.deviation_m),
//!             Err(why) => println!("not seen: {}", why.reason()),
//!         }
//!     }
//!     Ok(())
//! }
//! ```
//!
//! [`Client::next`] returns one [`Moment`] for each frame. A moment contains the people and, on request, the pose and the picture of every
//! view. A thread reads the deployment and matches these parts by the number of the frame. It keeps a limited number of moments for the
//! caller: either only the newest moment, or every moment in order ([`Wish::every_frame`]).
//!
//! A client cannot send anything to the deployment: neither this crate nor [`runtime::Guest`], on which it is based, has a function for it.
//! The pipeline does not wait for a client, does not wake it, and does not count it among its receivers. If a process of the deployment
//! restarts, the client receives its messages again without any action. When the deployment ends, the client disconnects, and connects to
//! the next deployment with the same name ([`Client::state`]).
//!
//! The client checks every message before the caller receives it: session, counts, sizes and numbers. Invalid messages are rejected and
//! counted ([`Client::losses`]).
#![forbid(unsafe_code)]

mod check;
mod connection;
mod error;
mod joiner;
mod lock;
mod moment;
pub mod publish;
mod reader;
mod wish;

pub use error::ClientError;
pub use moment::{Joint, Moment, Picture, Place, Skeleton, Skeletons, ViewMoment};
pub use reader::{Client, Losses, State};
pub use runfiles::{Running, RunningView};
pub use wish::Wish;
