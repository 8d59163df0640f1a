//! The keypoints of a film that another program found, either as a folder with a file for every frame, or as one file for all frames.
//!
//! [`KeypointSource`] opens either of them and returns the people of a frame. [`crate::files`] parses the content of the files.

mod error;
mod folder;
mod order;
mod source;

pub use error::KeypointFileError;
pub use source::KeypointSource;
