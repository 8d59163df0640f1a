//! TRC files (`OpenSim` markers), read and written: five header lines, then a row a frame, tab separated. Pure: text in,
//! text out.

mod read;
mod write;

pub use read::{Trc, TrcError};
pub use write::{Heading, row};
