//! The input of a fusion of two views.

use crate::{Epipolar, TypeTables, ViewInput};

/// A pair of views of one frame.
#[derive(Debug, Clone, Copy)]
pub struct PairInput<'a> {
    /// The two views.
    pub views: [ViewInput<'a>; 2],
    /// Geometry of the views, from the first to the second.
    pub epipolar: Epipolar,
    /// Part-type tables of the pair, if any were learned.
    pub tables: Option<&'a TypeTables>,
}
