//! Cells and weights in bfloat16, as the tiles of a matrix unit take them.

use crate::N_CHANNELS;
use crate::simd::Row;

/// Rows of a tile, and columns of single precision: cells and filters of a product.
pub(crate) const SIDE: usize = 16;
/// Cells of a block: two tiles of them.
pub(crate) const BLOCK: usize = 2 * SIDE;

/// The sums of a block of cells, a filter in each lane.
pub(crate) type Block = [Row; BLOCK];

/// The channels of a cell: a row of a tile, at the beginning of a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Cell(pub(crate) [u16; N_CHANNELS]);

/// Weights of 32 filters for one filter cell: two tiles of 16 filters, `[channel / 2][filter][channel % 2]`.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Weights(pub(crate) [[[[u16; 2]; SIDE]; SIDE]; 2]);

/// A filter's rows over those of a map.
pub(crate) struct Sums<'a> {
    /// Begins with the cell under the first filter cell of the first sum.
    pub(crate) cells: &'a [Cell],
    /// Cells from one row of the map to the next.
    pub(crate) stride: usize,
    /// Size `[rows, cols]` of the filter.
    pub(crate) filter: [usize; 2],
    /// One for each filter cell, row by row.
    pub(crate) weights: &'a [Weights],
}
