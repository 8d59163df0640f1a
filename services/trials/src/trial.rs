//! A run in which processes are killed on purpose: its cameras, the blow, and what it cost.
//!
//! What `parallax demo` and `parallax chaos` share.

pub(crate) mod stage;

pub(crate) mod strike;

pub(crate) mod results;

pub(crate) mod cost;

pub(crate) mod limit;

/// A place in space, metres in the world.
pub(crate) type Point = [f64; 3];
