//! A person's joints over time: smoothed, gaps filled and marked, angles between them.
//!
//! Pure: numbers in, numbers out. The joints are measured with a covariance each, at instants that need not be uniform.
//!
//! | question | answer |
//! |---|---|
//! | where were the joints, with everything before and after? | [`smooth`] |
//! | the same with a zero-phase low-pass filter, as laboratories use it | [`butterworth::filter`] |
//! | where are they now, with what was before? | [`live::Smoother`] |
//! | what are the angles of hips, knees, shoulders? | [`angles::angles`] |
//! | from and to the lines of a run's results | [`lines`] |
//! | how good is a smoother, against the truth? | [`judge`] |
#![forbid(unsafe_code)]

pub mod angles;
pub mod butterworth;
pub mod finished;
pub mod judge;
pub mod lines;
pub mod live;

mod bones;
mod exchange;
mod joint_track;
mod model;
mod noise;
mod prior;
mod recorded;
mod role;
mod rts;
mod smoother;
mod track;
mod tune;

pub use noise::{Noise, Prior};
pub use prior::prior;
pub use recorded::{Counts, Joint, Motion, Recorded, Report, Sides, TimesError};
pub use role::{RIGID, Role, Side, mirrored_name};
pub use smoother::{Settings, as_measured, smooth};
pub use track::{Absent, Estimate, Measured, Smoothed, State};
