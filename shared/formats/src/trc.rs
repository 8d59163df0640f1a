//! Reading and writing of TRC files (`OpenSim` markers): five header lines, then one tab-separated row per frame. This module does no input
//! or output.

mod read;
mod write;

pub use read::{Trc, TrcError};
pub use write::{Heading, row};
