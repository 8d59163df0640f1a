//! Tests for pictures that were not taken at the instant of their frame. They cover the correction for known times, and the detection of a
//! camera whose times are wrong. Synthetic people of the crate `scene` move in front of simulated cameras, which see their joints exactly,
//! apart from noise.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]
#![expect(
    clippy::print_stdout,
    reason = "the measured figures are shown with --nocapture"
)]

mod bits;
mod film;
#[path = "../allocations/scene.rs"]
#[expect(dead_code, clippy::unwrap_used, reason = "another test uses it too")]
mod planted;
mod skew;
mod step;
