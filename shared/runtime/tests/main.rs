//! Ports and deployments within one process: one binary, because linking takes longer than most tests.

mod common;

mod deployment;
mod few_chunks;
mod lock;
mod onlooker;
mod ports;
mod spin;
mod zero_copy;
