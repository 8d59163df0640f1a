//! Reading and writing of a user's files: regular files only, always complete or absent, and never through another user's link.
#![forbid(unsafe_code)]

mod folder;
mod read;
mod replace;
mod user;

pub use folder::Folder;
pub use read::{MODEL, PICTURE, RESULTS, SETTINGS, open, read, read_text};
pub use replace::{beside, replace, replace_by, replace_unsynced};
pub use user::user;
