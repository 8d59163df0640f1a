//! Errors against a reference: PCP, PCK, and distances.
//!
//! In three dimensions, there are [`segment_errors`] (PCP3D, the paper's eq. 13), [`joint_errors`] and [`aligned`]
//! (MPJPE and its Procrustes form, 3D PCK), [`Changes`] against a baseline, and [`Bootstrap`] intervals for
//! all of them.

mod offsets;
mod pck;
mod pcp;
mod report;

mod joints3d;
mod pcp3d;

mod bootstrap;
mod changes;
mod ranks;

pub use bootstrap::{Bootstrap, Share};
pub use changes::Changes;
pub use joints3d::{aligned, joint_errors};
pub use offsets::{FOUND_WITHIN, Offset, height, offsets};
pub use pck::{PCK_GROUPS, best_covering, joints_found};
pub use pcp::{PARSE_STICKS, Pcp, PcpRule, pcp, sticks_found};
pub use pcp3d::{SEGMENT_NAMES, Segment, segment_errors, segments};
pub use ranks::{area_under_roc, rank_correlation};
pub use report::{PCK_SHARES, Report, evaluate};

/// A point in space.
pub type Point = [f64; 3];
