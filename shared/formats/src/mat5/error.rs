//! Errors of MATLAB files.

use std::io;

/// Why bytes are not a MATLAB level 5 file.
#[derive(Debug, thiserror::Error)]
pub enum ContainerError {
    /// HDF5, which MATLAB calls version 7.3.
    #[error("the file is of MATLAB version 7.3: save it again with `save -v7`")]
    Version73,
    /// Written on a big-endian machine, or not a MATLAB file.
    #[error("the header's endian mark is {got:?}, expected \"IM\" (little-endian)")]
    Endian {
        /// The two characters.
        got: String,
    },
    /// The file ends too early.
    #[error("the file ends within {what}: {got} bytes left, {expected} needed")]
    Ended {
        /// Item that was being read.
        what: &'static str,
        /// Bytes left.
        got: usize,
        /// Bytes needed.
        expected: usize,
    },
    /// A tag has an unexpected type.
    #[error("{what} has type {got}, expected {expected}")]
    Type {
        /// Item that was being read.
        what: &'static str,
        /// The type's number.
        got: u32,
        /// The types accepted.
        expected: &'static str,
    },
    /// An array's sizes and its values disagree.
    #[error("an array of {sizes:?} holds {got} values")]
    Size {
        /// Its sizes.
        sizes: Vec<i32>,
        /// Values found.
        got: usize,
    },
    /// The file exceeds a limit that models and annotations do not reach.
    #[error("the file holds more than {limit} {what}")]
    TooMuch {
        /// Item that is counted.
        what: &'static str,
        /// The number accepted.
        limit: usize,
    },
    /// A compressed variable is damaged.
    #[error("a compressed variable is damaged")]
    Inflate(#[source] io::Error),
}
