//! A person's joints over time: smooths them, fills and marks gaps, and computes angles between them.
//!
//! The crate is pure: it takes and returns numbers, except for the files of a finished run. Every measured joint has a covariance. The
//! instants need not be uniform.
//!
//! | question | answer |
//! |---|---|
//! | where were the joints, given everything before and after? | [`smooth`] |
//! | the same with a zero-phase low-pass filter, as used by laboratories | [`butterworth::filter`] |
//! | where are the joints now, given everything before? | [`live::Smoother`] |
//! | what are the angles of hips, knees, shoulders? | [`angles::angles`] |
//! | how to convert from and to the lines of a run's results? | [`lines`] |
//! | how good is a smoother, compared with the truth? | [`judge`] |
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
