//! Reads keypoints that other programs have written to JSON files.
//!
//! | layout | files | read by |
//! |---|---|---|
//! | OpenPose | one for every frame | [`openpose::parse`] |
//! | COCO: a data set or a list of results | one for all frames | [`coco::parse`] |
//! | mmpose | one for every frame, or one for all frames | either of these two functions |
//!
//! Positions are pixels of the footage with the centre of the top-left pixel at (0, 0). This module takes text and opens no file. It checks
//! all content: numbers, lengths and counts must be within limits.

pub mod coco;
pub mod openpose;

mod json;
mod mmpose;
mod names;
mod people;
mod seen;

pub use names::{NameSet, NamesError};
pub use seen::{FileError, MAX_FRAMES, MAX_PEOPLE, SeenKeypoints};
