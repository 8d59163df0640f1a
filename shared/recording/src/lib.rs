//! A run as one MCAP file: every message of every topic, found again even where the file was cut off.
//!
//! The file is MCAP as others write it: chunked, indexed, not compressed. Messages are CDR, little
//! endian, with ROS 2 schemas (`msg/`), which other programs read too: a `repr(C)` struct without
//! padding has the layout that CDR asks for. Every message has a checksum, which is compared when it is read, and so
//! has all that says where messages lie and of which run they are. Nothing here knows files, clocks or threads.
#![forbid(unsafe_code)]

mod kind;
mod message;

mod mcap;

mod checks;
mod seal;

mod about;
mod count;
mod write;

mod chunk;
mod cursor;
mod found;
mod index;
mod older;
mod scan;

pub use about::{About, AboutError, Without};
pub use count::Count;
pub use index::{Checked, Damage, Entry, Extent, Recording, Track, in_order};
pub use kind::Kind;
pub use message::{Envelope, Malformed, Message, encode};
pub use scan::{Damaged, ReadError, check, read, scan};
pub use write::{WriteError, Writer};
