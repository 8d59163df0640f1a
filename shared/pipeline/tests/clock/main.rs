//! Pictures that were not taken when their frame says: what is done about those whose time is known, and how a camera whose times
//! are wrong is found. People of the crate `scene` move before planted cameras; views see their joints exactly, but for noise.

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
