//! The files that a run leaves behind, as types. `results` writes them, and all later programs read them.
//!
//! | file | type | one for each |
//! |---|---|---|
//! | `pose3d.jsonl` | [`FrameLine`] | frame, with a result or without |
//! | `pose2d.jsonl` | [`ViewLine`] | view of a frame that has a result |
//! | `times.jsonl` | [`TimesLine`] | frame that has a result |
//! | `pose3d-smooth.jsonl` | [`FrameLine`] | frame of a run that was smoothed |
//! | `smooth.json` | [`SmoothReport`] | run that was smoothed |
//! | `latency.json` | [`LatencyReport`] | run |
//! | `summary.json` | [`RunSummary`] | run; has the version of all files |
//!
//! [`Running`] is not a file of a run. It is the description that a running deployment publishes for other programs.
//!
//! This crate converts text to types and opens no file. A field that is missing, has an unknown type or is out of range is a
//! [`ReadError`] that names the line and the field. Only fields that were added later may be missing. Unknown fields are ignored, so that
//! a program can read the files of a later one as long as [`VERSION`] is the same.
//!
//! Fields are written in alphabetical order, so they are declared in that order.
#![forbid(unsafe_code)]

mod frame;
mod latency;
mod missing;
mod nullable;
mod read;
mod running;
mod smooth;
mod summary;
mod times;
mod trust;
mod view;

pub use frame::{FrameLine, JointLine, Kept, MOST_PEOPLE, PersonLine, PlacedJoint, Sides};
pub use latency::{LatencyReport, Percentiles};
pub use missing::Missing;
pub use read::{Line, ReadError, lines, to_line};
pub use running::{Running, RunningError, RunningView};
pub use smooth::{SmoothReport, SmoothedJoint, SmoothedPerson, Unsure};
pub use summary::{
    CameraFit, Contradicted, Exchanged, People, PersonSummary, RunSummary, Summary, ViewSummary,
};
pub use times::{CameraTimes, PoseTimes, TimesLine, ViewTimes};
pub use trust::{Doubt, Trust};
pub use view::{Facing, FusedPose, Part, SinglePose, TypedPart, ViewLine};

/// Version of all files of a run. It increases when a field changes its meaning or is removed.
pub const VERSION: u64 = 2;

#[cfg(test)]
mod tests;
