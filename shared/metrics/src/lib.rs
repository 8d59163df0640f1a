//! Where the time of a process goes: measured in the process, sent as a message, read with care.
//!
//! A [`Meter`] takes durations and counts, [`Rates`] say how often something happened lately, and a
//! [`Reading`] is what a message of another process says, checked. Nothing here reads a clock.
#![forbid(unsafe_code)]

mod meter;
mod rates;

mod reading;

pub use meter::{Meter, Passage};
pub use rates::Rates;
pub use reading::{Reading, ReadingError, Timed, ViewName};
