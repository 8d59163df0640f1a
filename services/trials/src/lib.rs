//! Runs that try a deployment: with a fault made on purpose, under load, or for show; and what held.
//!
//! | trial | what is done | what is judged |
//! |---|---|---|
//! | [`chaos`] | a process is killed, stopped or sent spinning, a camera fails or was moved | who noticed, who came back, what was lost |
//! | [`mod@bench`] | messages are sent, deployments are run as fast as they go | how long it took |
//! | [`demo`] | cameras that do not exist see a person who does not, and one of them is killed | results against the truth, and all of the above |
//!
//! Every run is one of real processes, started as `parallax run` starts them. What a command line says becomes the
//! options of a trial; what it prints at the end is in what a trial returns. Progress is shown meanwhile.
#![forbid(unsafe_code)]

mod spread;
mod trial;

pub mod bench;
pub mod chaos;
pub mod demo;
