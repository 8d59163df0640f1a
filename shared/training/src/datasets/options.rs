//! Options for reading a data set: which people are read, and which faults are accepted.

use crate::datasets::{FaultKind, Selection};

/// Options for reading a data set: which people are read, and which faults are accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// The people to read; all if `None`.
    pub only: Option<Selection>,
    /// The people to leave out, such as the people of a test set.
    pub without: Option<Selection>,
    /// Number of joints of a person; if `None`, every person must have as many joints as the first.
    pub n_joints: Option<usize>,
    /// Largest accepted distance between a joint outside the image and the border of the image, in pixels. Hand-marked joints are up to 2
    /// px outside.
    pub outside_px: f64,
    /// True if people with unknown joints are read.
    pub unknown_joints: bool,
    /// Kinds of faults that make reading fail. People with other faults are left out.
    pub fatal: Vec<FaultKind>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            only: None,
            without: None,
            n_joints: None,
            outside_px: 2.0,
            unknown_joints: false,
            fatal: Vec::new(),
        }
    }
}
