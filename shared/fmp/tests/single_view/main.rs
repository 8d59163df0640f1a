//! The public interface of the detector, on random evidence and on synthetic images.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
mod images;
mod incremental;
mod other_view;
mod scope;
mod solver;
mod track;
