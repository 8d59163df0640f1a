//! Laws of the optimiser on small planted scenes, against an energy written down a second time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod oracle;
mod planted;

mod all_views;
mod paper;
mod released;
mod start;
