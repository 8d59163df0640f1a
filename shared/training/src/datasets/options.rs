//! Which people of a data set are read, and which of their faults are accepted.

use crate::datasets::{FaultKind, Selection};

/// Which people of a data set are read, and which faults are accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// The people to read; all if not set.
    pub only: Option<Selection>,
    /// The people to leave out, such as a test set.
    pub without: Option<Selection>,
    /// Number of joints of a person; that of the first person if not set.
    pub n_joints: Option<usize>,
    /// How far outside the image a joint may lie, pixels. Clicked joints lie up to 2 px outside.
    pub outside_px: f64,
    /// True if people with unknown joints are read.
    pub unknown_joints: bool,
    /// Kinds of fault that make the whole data set an error; people with other faults are left out.
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
