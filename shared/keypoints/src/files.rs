//! Keypoints that other programs wrote into JSON files.
//!
//! | layout | files | read by |
//! |---|---|---|
//! | OpenPose's | one for every frame | [`openpose::parse`] |
//! | COCO's, a data set or a list of results | one for all frames | [`coco::parse`] |
//! | mmpose's | one for every frame, or for all | either of the two |
//!
//! Positions are pixels of the footage with the centre of the top-left pixel at (0, 0). This module takes text and opens no file. It
//! checks all content: numbers, lengths and counts have limits.

pub mod coco;
pub mod openpose;

mod json;
mod mmpose;
mod names;
mod people;
mod seen;

pub use names::{NameSet, NamesError};
pub use seen::{FileError, MAX_FRAMES, MAX_PEOPLE, SeenKeypoints};
