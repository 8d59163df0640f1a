//! Checksums of bytes, and the checked header in front of the payload of Parallax's own binary files. Pure: bytes in,
//! bytes out.

mod envelope;
mod fnv;

pub use envelope::{Envelope, EnvelopeError, HEADER_BYTES};
pub use fnv::{fnv1a, fnv1a_32, fnv1a_of};
