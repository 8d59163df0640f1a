//! Trials of whole deployments: fault injection, benchmarks and the demo, with limits that are checked.
//!
//! | trial | what is run | what is checked |
//! |---|---|---|
//! | [`chaos`] | a process is killed, stopped or made to loop endlessly; a camera fails or was moved | detection, recovery and losses |
//! | [`mod@bench`] | messages between two processes; deployments under load | latency and throughput |
//! | [`demo`] | synthetic cameras, one of whose processes is killed | accuracy of the results, recovery and losses |
//!
//! Every run uses real processes, started as `parallax run` starts them. The command line provides the options of a trial
//! and prints what it returns; progress is shown during the run.
#![forbid(unsafe_code)]

mod spread;
mod trial;

pub mod bench;
pub mod chaos;
pub mod demo;
