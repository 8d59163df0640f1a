//! Deployments of small processes: one binary, because linking takes longer than most tests.

mod common;

mod faults;
mod runs;
