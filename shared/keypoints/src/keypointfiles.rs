//! The keypoints of a film that another program found: a folder with a file for every frame, or one file for all frames.
//!
//! [`KeypointSource`] opens either and gives the people of a frame. What the files say is read by [`crate::files`].

mod error;
mod folder;
mod order;
mod source;

pub use error::KeypointFileError;
pub use source::KeypointSource;
