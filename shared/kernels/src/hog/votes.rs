//! Votes of pixels for the cells around them.
//!
//! The centres of four neighbouring cells are the corners of a block of `cell_px x cell_px` pixels. These pixels vote only for these four
//! cells. A block sums its votes, one pixel after the other, each multiplied by a vector of four shares, one per cell. Then every cell adds
//! the sums of its four blocks.

use super::Vote;
use crate::Planes;
use crate::gradient::{N_ORIENTATIONS, gradients};

/// Votes of one row of blocks.
#[derive(Debug, Default)]
pub(super) struct Votes {
    cell_px: usize,
    n_blocks: usize,
    /// Shares of the pixels of a block, `[row][col]`, for the cells at its corners.
    shares: Vec<[f32; 4]>,
    /// Gradients of a row of pixels, starting with the first pixel of the first block. The length is 0 at positions without a vote.
    lengths: Vec<f32>,
    bins: Vec<u32>,
    /// Sums, `N_ORIENTATIONS x n_blocks`: upper left, upper right, lower left, lower right.
    sums: Vec<[f32; 4]>,
}

impl Votes {
    pub(super) fn prepare(&mut self, cell_px: usize, cols: usize) {
        self.cell_px = cell_px;
        self.n_blocks = cols + 1;
        let first = cell_px / 2;
        let pixels = (first..first + cell_px).map(|i| Vote::of(i, cell_px).share);
        self.shares.clear();
        for [up, down] in pixels.clone().map(|pixel| pixel.map(|value| value as f32)) {
            for [left, right] in pixels.clone().map(|pixel| pixel.map(|value| value as f32)) {
                self.shares.push([left * up, right * up, left * down, right * down]);
            }
        }
        self.lengths.clear();
        self.lengths.resize(self.n_blocks * cell_px, 0.0);
        self.bins.clear();
        self.bins.resize(self.n_blocks * cell_px, 0);
        self.sums.clear();
        self.sums.resize(N_ORIENTATIONS * self.n_blocks, [0.0; 4]);
    }

    /// Sums the votes of the `block`th row of blocks. The first row is half outside the image.
    #[inline(always)]
    pub(super) fn count(&mut self, image: &Planes, block: usize, [rows, cols]: [usize; 2]) {
        self.sums.fill([0.0; 4]);
        let before = self.cell_px.div_ceil(2);
        for row in 0..self.cell_px {
            // Row number, counted from `before` rows above the image.
            let y = block * self.cell_px + row;
            if y <= before || y > before + rows * self.cell_px - 2 {
                continue;
            }
            if y - before <= image.height() - 2 {
                self.take_gradients(image, y - before, cols);
            }
            self.add_row(row);
        }
    }

    /// Gradients of row `y`. The last pixel inside the image is repeated for the pixels after it.
    #[inline(always)]
    fn take_gradients(&mut self, image: &Planes, y: usize, cols: usize) {
        let before = self.cell_px.div_ceil(2);
        gradients(
            image,
            y,
            &mut self.lengths[before + 1..],
            &mut self.bins[before + 1..],
        );
        let inside = before + image.width() - 1;
        let voting = before + cols * self.cell_px - 1;
        let (length, bin) = (self.lengths[inside - 1], self.bins[inside - 1]);
        if inside < voting {
            self.lengths[inside..voting].fill(length);
            self.bins[inside..voting].fill(bin);
        }
        self.lengths[voting..].fill(0.0);
    }

    #[inline(always)]
    fn add_row(&mut self, row: usize) {
        let n = self.cell_px;
        let shares = &self.shares[row * n..][..n];
        if let Ok(shares) = shares.try_into() {
            // The loop is unrolled for the cell size of all published models.
            let (lengths, _) = self.lengths.as_chunks::<4>();
            let (bins, _) = self.bins.as_chunks::<4>();
            return add_blocks::<4>(shares, lengths, bins, &mut self.sums);
        }
        let blocks = self.lengths.chunks_exact(n).zip(self.bins.chunks_exact(n));
        for (block, (lengths, bins)) in blocks.enumerate() {
            for ((shares, length), bin) in shares.iter().zip(lengths).zip(bins) {
                let sums = &mut self.sums[*bin as usize * self.n_blocks + block];
                *sums = add_pixel(*sums, *shares, *length);
            }
        }
    }

    /// Adds the sums of this row of blocks to the cells above it; `N_ORIENTATIONS x stride`.
    #[inline(always)]
    pub(super) fn add_upper(&self, cells: &mut [f32], stride: usize) {
        let lines = cells.chunks_exact_mut(stride);
        for (cells, sums) in lines.zip(self.sums.chunks_exact(self.n_blocks)) {
            let pairs = sums.iter().zip(&sums[1..]);
            for (cell, ([_, a, _, _], [b, _, _, _])) in cells.iter_mut().zip(pairs) {
                *cell += a + b;
            }
        }
    }

    /// Writes the sums of this row of blocks to the cells below it; `N_ORIENTATIONS x stride`.
    #[inline(always)]
    pub(super) fn put_lower(&self, cells: &mut [f32], stride: usize) {
        let lines = cells.chunks_exact_mut(stride);
        for (cells, sums) in lines.zip(self.sums.chunks_exact(self.n_blocks)) {
            let pairs = sums.iter().zip(&sums[1..]);
            for (cell, ([_, _, _, a], [_, _, b, _])) in cells.iter_mut().zip(pairs) {
                *cell = a + b;
            }
        }
    }
}

#[inline(always)]
fn add_blocks<const N: usize>(
    shares: &[[f32; 4]; N],
    lengths: &[[f32; N]],
    bins: &[[u32; N]],
    sums: &mut [[f32; 4]],
) {
    let n_blocks = lengths.len();
    for (block, (lengths, bins)) in lengths.iter().zip(bins).enumerate() {
        for at in 0..N {
            let sums = &mut sums[bins[at] as usize * n_blocks + block];
            *sums = add_pixel(*sums, shares[at], lengths[at]);
        }
    }
}

#[inline(always)]
fn add_pixel(mut sums: [f32; 4], shares: [f32; 4], length: f32) -> [f32; 4] {
    for corner in 0..4 {
        sums[corner] += shares[corner] * length;
    }
    sums
}
