//! Common parts of the trials: synthetic deployments, the injection of process faults, results, and limits.

pub(crate) mod synthetic;

pub(crate) mod injection;

pub(crate) mod results;

pub(crate) mod cost;

pub(crate) mod limit;

/// A point in the world, in metres.
pub(crate) type Point = [f64; 3];
