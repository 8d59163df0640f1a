//! Statistics: percentiles and medians, and errors against a reference with confidence intervals ([`score`]). All functions are pure.
#![forbid(unsafe_code)]

pub mod score;
mod sorted;

pub use sorted::{Number, Sorted};
