//! The public face of the detector, on made-up evidence and on planted images.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
mod images;
mod incremental;
mod other_view;
mod scope;
mod solver;
mod track;
