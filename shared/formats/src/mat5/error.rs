//! Errors of MATLAB files.

use std::io;

/// Reason why bytes are not a MATLAB level 5 file.
#[derive(Debug, thiserror::Error)]
pub enum ContainerError {
    /// The file is HDF5, which MATLAB calls version 7.3.
    #[error("the file is of MATLAB version 7.3: save it again with `save -v7`")]
    Version73,
    /// The file was written on a big-endian machine, or is not a MATLAB file.
    #[error("the header's endian mark is {got:?}, expected \"IM\" (little-endian)")]
    Endian {
        /// The two characters that were found.
        got: String,
    },
    /// The file ends too early.
    #[error("the file ends within {what}: {got} bytes left, {expected} needed")]
    Ended {
        /// Name of the item that was being read.
        what: &'static str,
        /// Number of bytes left.
        got: usize,
        /// Number of bytes needed.
        expected: usize,
    },
    /// A tag has an unexpected type.
    #[error("{what} has type {got}, expected {expected}")]
    Type {
        /// Name of the item that was being read.
        what: &'static str,
        /// Number of the type.
        got: u32,
        /// Accepted types.
        expected: &'static str,
    },
    /// The sizes of an array and its number of values disagree.
    #[error("an array of size {sizes:?} contains {got} values")]
    Size {
        /// Sizes of the array.
        sizes: Vec<i32>,
        /// Number of values found.
        got: usize,
    },
    /// The file exceeds a limit that no model or annotation reaches.
    #[error("the file holds more than {limit} {what}")]
    TooMuch {
        /// Name of the items that are counted.
        what: &'static str,
        /// Maximum number of items.
        limit: usize,
    },
    /// A compressed variable is damaged.
    #[error("a compressed variable is damaged")]
    Inflate(#[source] io::Error),
}
