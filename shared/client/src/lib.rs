//! A read-only door to a running deployment, for programs of one's own.
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
//! [`Client::next`] gives one [`Moment`] for each frame: the people, and if asked for the pose and the picture of every view,
//! joined by the number of the frame. A thread reads the deployment; what waits for the caller is bounded, and either only the
//! newest moment or every one is given ([`Wish::every_frame`]).
//!
//! Nothing can be sent to the deployment: neither this crate nor [`runtime::Guest`], on which it stands, has a way to. The pipeline does not wait for
//! a client, does not wake it, and does not count it among its receivers. A process of the deployment that is started anew
//! is heard again without a word; when the deployment ends the client leaves it by itself, and joins the next one of that
//! name ([`Client::state`]).
//!
//! Every message is checked before it is given: session, counts, sizes, numbers. What is wrong is refused and counted
//! ([`Client::losses`]).
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
