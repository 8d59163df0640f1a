//! Tests of ports and deployments within one process. They are in one binary, because linking takes longer than most tests.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

mod deployment;
mod few_chunks;
mod lock;
mod observer;
mod onlooker;
mod ports;
mod spin;
mod zero_copy;
