//! A page in the browser that shows a deployment while it runs, or a finished run. It shows the 3D skeleton with its uncertainty, the
//! pictures of all cameras, rates, latency, missing processes, and errors.
//!
//! A thread follows the deployment ([`runtime::Bus::as_onlooker`]) and puts the newest messages on a board. Every open page has a thread
//! that sends the new messages from the board. Therefore no process of the deployment waits for a page, and a slow page misses frames.
//! Memory use does not grow with the number of frames, or when a page does not fetch its messages.
//!
//! | part | module |
//! |---|---|
//! | the run to show, and the address to listen on | [`Options`], [`run`] |
//! | cameras, joints, meaning of the numbers | `scene` |
//! | one frame as text for the page | `moment` |
//! | a reduced picture as JPEG | `picture` |
//! | a running deployment | `live` |
//! | a finished run: its folder or its recording | `finished` |
//! | access rules, and the files of the page | `server` |
//! | connections and requests | `door`, `http` |
//! | the messages to and from one page | `socket` |
#![forbid(unsafe_code)]

mod board;
mod date;
mod door;
mod http;
mod moment;
mod picture;
mod scene;

mod finished;
mod live;

mod server;
mod site;
mod socket;

mod companion;
mod options;
mod run;

pub use companion::Companion;
pub use options::{Listen, Options, Subject};
pub use run::run;
