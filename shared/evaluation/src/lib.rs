//! Errors against a reference: PCP, distances, percentiles, and the TRC files references come in.
#![forbid(unsafe_code)]

mod pcp;
mod percentile;
mod trc;

pub use pcp::{PARSE_STICKS, Pcp, PcpRule, pcp};
pub use percentile::percentile;
pub use trc::{Trc, TrcError};
