//! The searched cells of the pyramid: some levels, and a rectangle of the image.

use std::ops::Range;

use crate::{Layout, Placement, Pose};

/// A rectangle of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column, and one past the last, in pixels.
    pub x: [u32; 2],
    /// First row, and one past the last, in pixels.
    pub y: [u32; 2],
}

/// Some levels of a layout, and the cells of these levels in a region of the image.
///
/// Placements are always counted in cells of the whole layout; only arrays with one value per cell are smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// First level, and one past the last.
    levels: [u16; 2],
    region: Region,
    is_whole: bool,
}

/// Cells of the response maps of one level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First row, as an index in the level.
    pub top: usize,
    /// First column, as an index in the level.
    pub left: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
}

/// The error for a scope that does not fit the layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ScopeError {
    /// The levels are empty or outside the layout.
    #[error(
        "the range of levels {first} to {end} is empty, or beyond the {n_levels} levels of the layout"
    )]
    Levels {
        /// First requested level.
        first: u16,
        /// One past the last requested level.
        end: u16,
        /// Number of levels of the layout.
        n_levels: usize,
    },
    /// The region is empty or not inside the image.
    #[error("the range {begin} to {end} is empty, or beyond the {side} pixels of the image")]
    Region {
        /// First pixel of the range.
        begin: u32,
        /// One past the last pixel of the range.
        end: u32,
        /// Side of the image, in pixels.
        side: usize,
    },
}

impl Scope {
    /// Creates a scope, checking that the levels and the region exist.
    ///
    /// # Errors
    ///
    /// [`ScopeError`].
    pub fn new(layout: &Layout, levels: Range<u16>, region: Region) -> Result<Self, ScopeError> {
        let n_levels = layout.levels.len();
        if levels.is_empty() || usize::from(levels.end) > n_levels {
            return Err(ScopeError::Levels {
                first: levels.start,
                end: levels.end,
                n_levels,
            });
        }
        for ([begin, end], side) in [region.x, region.y].into_iter().zip(layout.image_size) {
            if begin >= end || end as usize > side {
                return Err(ScopeError::Region { begin, end, side });
            }
        }
        let levels = [levels.start, levels.end];
        Ok(Self {
            levels,
            region,
            is_whole: region == Self::whole(layout).region,
        })
    }

    /// Returns the scope of all levels and the whole image.
    pub fn whole(layout: &Layout) -> Self {
        let [width, height] = layout.image_size.map(|image_size| image_size as u32);
        Self {
            levels: [0, layout.levels.len() as u16],
            region: Region {
                x: [0, width],
                y: [0, height],
            },
            is_whole: true,
        }
    }

    /// Returns the levels.
    pub fn levels(&self) -> Range<u16> {
        self.levels[0]..self.levels[1]
    }

    /// Returns the region.
    pub fn region(&self) -> Region {
        self.region
    }
}

impl Layout {
    /// Returns the cells of a level that are in a scope: the cells at which the centre of the largest filter is in the region, and the
    /// adjacent cells outside the region. If the region ends at the border of the image, all remaining cells are included. There is at
    /// least one cell.
    pub fn window(&self, scope: &Scope, level: usize) -> Window {
        let it = &self.levels[level];
        if scope.is_whole {
            return Window {
                top: 0,
                left: 0,
                rows: it.rows,
                cols: it.cols,
            };
        }
        let filter =
            [0, 1].map(|axis| (it.padded[axis] + 1).saturating_sub([it.rows, it.cols][axis]));
        let [width, height] = self.image_size;
        let cols = Axis {
            n_cells: it.cols,
            pad: self.pad[1],
            filter: filter[1],
            side: width,
        };
        let rows = Axis {
            n_cells: it.rows,
            pad: self.pad[0],
            filter: filter[0],
            side: height,
        };
        let cols = cols.cells(it.scale, scope.region.x);
        let rows = rows.cells(it.scale, scope.region.y);
        Window {
            top: rows.start,
            left: cols.start,
            rows: rows.len(),
            cols: cols.len(),
        }
    }

    /// Returns the number of response values of all levels and filters of a scope.
    pub fn n_values(&self, scope: &Scope) -> usize {
        let levels = usize::from(scope.levels[0])..usize::from(scope.levels[1]);
        self.values_of(scope, levels)
    }

    /// Returns the position of a level's response maps in the array of a scope's responses, which is
    /// `[level][filter][row][col]` without gaps.
    pub fn maps_in(&self, scope: &Scope, level: usize) -> Range<usize> {
        let before = self.values_of(scope, usize::from(scope.levels[0])..level);
        before..before + self.values_of(scope, level..level + 1)
    }

    fn values_of(&self, scope: &Scope, levels: Range<usize>) -> usize {
        let area = |level| {
            let it = self.window(scope, level);
            it.rows * it.cols * self.n_filters
        };
        levels.map(area).sum()
    }
}

/// The cells of a level along one axis.
struct Axis {
    n_cells: usize,
    pad: usize,
    filter: usize,
    /// Side of the image, in pixels.
    side: usize,
}

impl Axis {
    /// See [`Layout::window`]; the inverse of [`Layout::centre`].
    fn cells(&self, scale: f64, [begin, end]: [u32; 2]) -> Range<usize> {
        let cell_of =
            |px: u32| (f64::from(px) + 0.5) / scale - self.filter as f64 / 2.0 + self.pad as f64;
        let last_cell = self.n_cells.saturating_sub(1);
        let first = match begin {
            0 => 0,
            _ => (cell_of(begin).floor().max(0.0) as usize).min(last_cell),
        };
        let end = if end as usize >= self.side {
            self.n_cells
        } else {
            let last = cell_of(end - 1).ceil().max(0.0) as usize;
            (last + 1).clamp(first + 1, self.n_cells.max(first + 1))
        };
        first..end
    }
}

impl Window {
    /// Returns true if a placement is on one of these cells.
    pub fn contains(&self, at: Placement) -> bool {
        let (y, x) = (usize::from(at.y), usize::from(at.x));
        (self.top..self.top + self.rows).contains(&y)
            && (self.left..self.left + self.cols).contains(&x)
    }

    /// Returns true if all parts of a pose on this level are on these cells.
    pub fn contains_all(&self, pose: &Pose) -> bool {
        pose.parts.iter().all(|part| self.contains(*part))
    }
}
