//! A corner of a board in a picture, or why there is none.

use nalgebra::Point2;

/// A corner of the board in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Its number: an index of [`Layout::points`](crate::boards::Layout::points).
    pub id: usize,
    /// Where it is, pixels.
    pub at: Point2<f64>,
}

/// Why there is no board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Nothing {
    /// No grid of corners.
    NoGrid,
    /// A grid of other counts than the board's.
    OtherGrid {
        /// Inner corners from left to right, or from top to bottom.
        columns: usize,
        /// The others.
        rows: usize,
    },
    /// Fewer than two markers of the board.
    NoMarkers,
    /// Markers, but not where the board has them.
    Elsewhere {
        /// How many were read.
        n_markers: usize,
    },
    /// The board is there; too few of its corners are sharp.
    NoCorners,
}

impl Nothing {
    /// The one that says more.
    pub(crate) fn or(self, other: Self) -> Self {
        let says = |nothing: Self| match nothing {
            Self::NoGrid | Self::NoMarkers => 0,
            Self::OtherGrid { .. } => 1,
            Self::Elsewhere { n_markers } => 1 + n_markers,
            Self::NoCorners => usize::MAX,
        };
        if says(other) > says(self) {
            other
        } else {
            self
        }
    }
}
