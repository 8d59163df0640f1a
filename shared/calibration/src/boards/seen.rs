//! A corner of a board in a picture, or the reason why no board was found.

use nalgebra::Point2;

/// A corner of the board in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Number of the corner: an index of [`Layout::points`](crate::boards::Layout::points).
    pub id: usize,
    /// Position of the corner, in pixels.
    pub at: Point2<f64>,
}

/// Reason why no board was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Nothing {
    /// The picture has no grid of corners.
    NoGrid,
    /// The picture has a grid with different numbers of rows and columns than the board.
    OtherGrid {
        /// Number of inner corners along one side of the grid.
        columns: usize,
        /// Number of inner corners along the other side.
        rows: usize,
    },
    /// The picture has fewer than two markers of the board.
    NoMarkers,
    /// The picture has markers, but not in the arrangement of the board.
    Elsewhere {
        /// Number of markers that were read.
        n_markers: usize,
    },
    /// The board is in the picture, but too few of its corners are sharp.
    NoCorners,
}

impl Nothing {
    /// Returns the more informative of two reasons.
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
