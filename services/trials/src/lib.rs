//! Trials of whole deployments: fault injection, benchmarks and the demo. Each trial checks its results against limits.
//!
//! | trial | what it runs | what it checks |
//! |---|---|---|
//! | [`chaos`] | a process is killed, stopped or hangs in an endless loop; a camera fails, or was moved | detection, recovery and losses |
//! | [`mod@bench`] | messages between two processes; deployments under load | latency and throughput |
//! | [`demo`] | synthetic cameras, one of which is killed | accuracy of the results, recovery and losses |
//!
//! Every run uses real processes, which are started as `parallax run` starts them. The command line passes the options of a trial and
//! prints its report. Progress is shown during the run.
#![forbid(unsafe_code)]

mod spread;
mod trial;

pub mod bench;
pub mod chaos;
pub mod demo;
