//! Times and counts of a process: measured in the process, sent as a message, and checked when read.
//!
//! A [`Meter`] collects durations and counts, [`Rates`] computes recent rates, and a [`Reading`] is the
//! checked content of another process's message. This module does not read a clock.

mod meter;
mod rates;

mod reading;

pub use meter::{Meter, Passage};
pub use rates::Rates;
pub use reading::{Reading, ReadingError, Timed, ViewName};
