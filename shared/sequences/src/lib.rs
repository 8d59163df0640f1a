//! Films of one person by several calibrated cameras, with the joints in space where they are known.
//!
//! [`read`] takes what a user has: the folder of a data set in its own layout (`HumanEva-I`, UMPM, our
//! synthetic scenes), or a file that describes any other sequence; and gives [`Sequence`]s. No pixel
//! is read here: a [`View`] says which footage to open, and where the sequence begins in it.
//!
//! [`read_motion`] takes a C3D or TRC file alone: what one person did, without cameras.
//!
//! Metres; the world is that of the calibration.
#![forbid(unsafe_code)]

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
