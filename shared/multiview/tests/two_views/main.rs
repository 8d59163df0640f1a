//! Properties of the optimiser on small artificial scenes, checked against an independent
//! computation of the energy.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod oracle;
mod planted;

mod all_views;
mod paper;
mod released;
mod start;
