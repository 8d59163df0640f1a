//! Tests of reading, warping and drawing. They are in one binary, because linking takes longer than most tests.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod clip;

mod bad_input;
mod conformance;
mod http;
mod kept;
mod overlay;
mod prompt;
mod told;
mod warp;
