//! Images and videos in, pictures out: one binary, because linking takes longer than most tests.

mod clip;

mod bad_input;
mod conformance;
mod overlay;
mod warp;
