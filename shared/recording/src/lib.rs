//! Writes and reads a run as one MCAP file, with every message of every topic. The file is readable even if it is truncated.
//!
//! The file is standard MCAP: chunked, indexed, not compressed. Messages are little-endian CDR with ROS 2 schemas (`msg/`), which other
//! programs can read, because a `repr(C)` struct without padding has the layout of CDR. Every chunk has a checksum, which is checked when a
//! message of the chunk is read. The metadata has a checksum, too. This crate does not use files, clocks or threads.
#![forbid(unsafe_code)]

mod kind;
mod message;

mod seal;

mod about;
mod count;
mod gate;
mod write;

mod chunk;
mod contents;
mod cursor;
mod index;
mod scan;

mod read;

pub use about::{About, AboutError, Without};
pub use count::Count;
pub use index::{Damage, Entry, Extent, Recording, Track, in_order};
pub use kind::Kind;
pub use message::{Envelope, Malformed, Message, encode, split_skeletons};
pub use read::{Buffer, Damaged, ReadError, check, read, read_head};
pub use scan::scan;
pub use write::{Foreign, WriteError, Writer};
