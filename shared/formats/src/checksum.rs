//! Checksums of bytes, and the header with a checksum that precedes the payload of Parallax's own binary files. This module does no input
//! or output.

mod envelope;
mod fnv;

pub use envelope::{Envelope, EnvelopeError, HEADER_BYTES};
pub use fnv::{fnv1a, fnv1a_32, fnv1a_of};
