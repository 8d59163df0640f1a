//! Recordings of one person by several calibrated cameras, with the true positions of the joints where they are known.
//!
//! [`read`] takes the folder of a data set in its own layout (`HumanEva-I`, UMPM, synthetic scenes of
//! Parallax), or a file that describes any other sequence, and returns [`Sequence`]s. It does not read any
//! pixels: a [`View`] contains the footage to open and the frame at which the sequence begins.
//!
//! [`read_motion`] takes a single C3D or TRC file: the motion of one person, without cameras.
//!
//! Lengths are in metres, in the world frame of the calibration.

mod error;
mod sequence;

mod described;
mod synthetic;

mod humaneva;
mod umpm;

mod motion;
mod open;

#[cfg(test)]
mod tests;

pub use error::{SequenceError, SyncError};
pub use humaneva::{PAPER_TEST, PaperTest, Sync, TRIAL};
pub use motion::{MarkerTable, Motion, MotionError, MotionOptions, PRESETS, read_motion};
pub use open::read;
pub use sequence::{Alignment, Frame, Options, Sequence, View};
