//! Numbers about numbers: percentiles and medians, and errors against a reference with their intervals ([`score`]). Pure.
#![forbid(unsafe_code)]

pub mod score;
mod sorted;

pub use sorted::{Number, Sorted};
