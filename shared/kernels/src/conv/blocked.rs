//! Stacks of channels whose values are stored in blocks of neighbouring channels.

use crate::simd::{ROW, Row, flat, flat_mut};

/// Number of channels stored next to each other.
pub(super) const BLOCK: usize = 16;

/// The shape of a [`Blocked`] stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BlockedShape {
    /// Number of channels.
    pub(super) channels: usize,
    /// Number of rows.
    pub(super) rows: usize,
    /// Number of columns.
    pub(super) cols: usize,
    /// Number of rows and columns of zeros on every side.
    pub(super) border: usize,
    /// Number of channels in a block.
    pub(super) width: usize,
}

impl BlockedShape {
    /// Makes a shape with blocks of 16 channels; the last block is padded with zeros.
    pub fn new([channels, rows, cols]: [usize; 3], border: usize) -> Self {
        Self {
            channels,
            rows,
            cols,
            border,
            width: BLOCK,
        }
    }

    /// Makes a shape with one block of all channels, for pictures, which have three.
    pub fn packed([channels, rows, cols]: [usize; 3], border: usize) -> Self {
        Self {
            width: channels,
            ..Self::new([channels, rows, cols], border)
        }
    }

    /// Channels, rows and columns.
    pub fn sides(&self) -> [usize; 3] {
        [self.channels, self.rows, self.cols]
    }

    #[inline(always)]
    pub(super) fn n_blocks(&self) -> usize {
        self.channels.div_ceil(self.width.max(1))
    }

    /// Number of floats from one row of a block to the next.
    pub(super) fn row(&self) -> usize {
        (self.cols + 2 * self.border) * self.width
    }

    /// Number of floats from one block to the next.
    pub(super) fn plane(&self) -> usize {
        (self.rows + 2 * self.border) * self.row()
    }

    fn len(&self) -> usize {
        self.n_blocks() * self.plane()
    }

    /// Index of the first channel of a block at a pixel.
    #[inline(always)]
    pub(super) fn at(&self, block: usize, row: usize, col: usize) -> usize {
        block * self.plane() + (row + self.border) * self.row() + (col + self.border) * self.width
    }
}

/// A stack of channels. The order is: blocks of neighbouring channels, then rows, columns, and the channels of the block. The
/// borders are zero.
#[derive(Debug, Clone)]
pub struct Blocked {
    shape: BlockedShape,
    rows: Vec<Row>,
}

impl Blocked {
    /// Makes a stack of zeros.
    pub fn new(shape: BlockedShape) -> Self {
        let rows = vec![Row::ZERO; shape.len().div_ceil(ROW)];
        Self { shape, rows }
    }

    /// The shape of the stack.
    pub fn shape(&self) -> BlockedShape {
        self.shape
    }

    /// The values, at least as many as the shape needs.
    #[inline(always)]
    pub(super) fn values(&self) -> &[f32] {
        flat(&self.rows)
    }

    #[inline(always)]
    pub(super) fn values_mut(&mut self) -> &mut [f32] {
        flat_mut(&mut self.rows)
    }

    /// A value, or zero outside the rows and columns.
    pub(super) fn get(&self, channel: usize, [row, col]: [Option<usize>; 2]) -> f32 {
        let row = row.filter(|row| *row < self.shape.rows);
        let col = col.filter(|col| *col < self.shape.cols);
        let (Some(row), Some(col)) = (row, col) else {
            return 0.0;
        };
        let width = self.shape.width;
        self.values()[self.shape.at(channel / width, row, col) + channel % width]
    }

    pub(super) fn set(&mut self, channel: usize, row: usize, col: usize, value: f32) {
        let width = self.shape.width;
        let at = self.shape.at(channel / width, row, col) + channel % width;
        self.values_mut()[at] = value;
    }

    /// Copies values that are stored channel by channel and row by row.
    ///
    /// # Panics
    ///
    /// Panics if the number of values does not match the channels, rows and columns.
    pub fn fill(&mut self, planes: &[f32]) {
        let shape = self.shape;
        let [channels, rows, cols] = shape.sides();
        assert_eq!(planes.len(), channels * rows * cols, "values of a stack");
        for channel in 0..channels {
            let (block, lane) = (channel / shape.width, channel % shape.width);
            for row in 0..rows {
                let from = &planes[(channel * rows + row) * cols..][..cols];
                let to = &mut self.values_mut()[shape.at(block, row, 0) + lane..];
                for (to, from) in to.iter_mut().step_by(shape.width).zip(from) {
                    *to = *from;
                }
            }
        }
    }

    /// Writes the values channel by channel and row by row.
    pub fn write(&self, planes: &mut Vec<f32>) {
        let shape = self.shape;
        planes.clear();
        planes.reserve(shape.channels * shape.rows * shape.cols);
        for channel in 0..shape.channels {
            let (block, lane) = (channel / shape.width, channel % shape.width);
            for row in 0..shape.rows {
                let from = &self.values()[shape.at(block, row, 0)..][..shape.cols * shape.width];
                planes.extend(from.chunks_exact(shape.width).map(|pixel| pixel[lane]));
            }
        }
    }
}
