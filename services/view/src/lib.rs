//! A page in the browser that shows a deployment while it runs, or a finished one: the skeleton in space with its
//! uncertainty, every camera's picture, rates, latency, who is missing, errors.
//!
//! A thread looks on ([`runtime::Bus::as_onlooker`]) and puts the newest of everything on a board; every open page has a
//! thread that sends what is new on the board. So no sender of the deployment waits for the page, a page that is slow misses
//! frames, and the memory does not grow with the number of frames or with what a page does not take.
//!
//! | part | where |
//! |---|---|
//! | what to show and where to listen | [`Options`], [`run`] |
//! | cameras, joints, what the numbers mean | `scene` |
//! | one frame as text for the page | `moment` |
//! | a picture made small, as JPEG | `picture` |
//! | a running deployment | `live` |
//! | a finished one: its folder, its recording | `finished` |
//! | who may ask, and the files of the page | `server` |
//! | connections and requests | `door`, `http` |
//! | the conversation with one page | `socket` |
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
