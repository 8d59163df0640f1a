//! Errors against a reference: PCP, PCK, distances, percentiles, and the TRC files references come in.
#![forbid(unsafe_code)]

mod pck;
mod pcp;
mod percentile;
mod report;
mod trc;

pub use pck::{PCK_GROUPS, best_covering, joints_found};
pub use pcp::{PARSE_STICKS, Pcp, PcpRule, pcp, sticks_found};
pub use percentile::percentile;
pub use report::{PCK_SHARES, Report, evaluate};
pub use trc::{Trc, TrcError};
