//! Tests with deployments of small processes. There is only one binary, because linking takes longer than most tests.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

mod faults;
mod runs;
