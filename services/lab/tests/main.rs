//! Tests of the laboratory, run as a user would run it. There is one test binary, because linking takes longer than most tests.

#[path = "../../parallax/tests/common/mod.rs"]
mod common;

mod eval;
mod eval_networks;
mod synth;
mod train;
