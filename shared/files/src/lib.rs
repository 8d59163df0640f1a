//! Reading and writing of a user's files. Only regular files are read. A written file is always either complete or absent, and links of
//! other users are not followed.
#![forbid(unsafe_code)]

mod folder;
mod read;
mod replace;
mod user;

pub use folder::Folder;
pub use read::{MODEL, PICTURE, RESULTS, SETTINGS, open, read, read_text};
pub use replace::{beside, replace, replace_by, replace_unsynced};
pub use user::user;
