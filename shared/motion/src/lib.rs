//! Smooths a person's joints over time, fills and marks gaps, and computes the angles between body segments.
//!
//! The crate only computes with numbers, except that it reads and writes the files of a finished run. Every measured joint has a
//! covariance. The instants need not be evenly spaced.
//!
//! | question | answer |
//! |---|---|
//! | where were the joints, given everything before and after? | [`smooth`] |
//! | the same, with a zero-phase low-pass filter as used in gait laboratories | [`butterworth::filter`] |
//! | where are the joints now, given everything before? | [`live::Smoother`] |
//! | what are the angles of hips, knees, shoulders? | [`angles::angles`] |
//! | how are these values read from and written to the result files of a run? | [`lines`] |
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
