//! The layout of every message, for programs in other languages: as a C header, and as JSON.
//!
//! Offsets, sizes and types are asked of the compiler; comments are those of the crate `messages`. A test sees that the fields
//! that are listed here fill every struct without a gap, so that a field that is added there cannot be forgotten here.
#![forbid(unsafe_code)]

mod comments;
mod header;
mod json;
mod table;

pub use header::c_header;
pub use json::json;
pub use table::{Field, Kind, Layout, Topic, layouts, topics};
