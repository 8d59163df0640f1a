//! Computes the features one row of cells at a time. A lane of a register is a pixel for the gradients, and a cell in all later steps.

use super::votes::Votes;
use super::{CLIP, FLAT, HogShape, N_CHANNELS, N_UNSIGNED, TEXTURE};
use crate::Planes;
use crate::dispatch::Body;
use crate::gradient::N_ORIENTATIONS;

/// Number of cells that are normalised at once.
const LANES: usize = 16;
type Lanes = [f32; LANES];

/// Buffers of [`hog`](super::hog()), reused from image to image.
#[derive(Debug, Default)]
pub struct HogWorkspace {
    votes: Votes,
    /// Histograms of the rows of cells that are still needed, by row number modulo 3; `N_ORIENTATIONS x stride`.
    histograms: [Vec<f32>; 3],
    /// Energies of the cells of a row, by row number modulo 2.
    energies: [Vec<f32>; 2],
    /// Norms of the blocks of 2 x 2 cells, stored at their upper left cell, by row number modulo 2.
    norms: [Vec<f32>; 2],
}

impl HogWorkspace {
    /// Reserves memory for images up to this size.
    pub fn reserve(&mut self, width: usize, height: usize, shape: HogShape) {
        let [_, cols] = shape.cells(width, height);
        self.prepare(stride(cols));
        self.votes.prepare(shape.cell_px, cols);
    }

    fn prepare(&mut self, stride: usize) {
        let fit = |buffer: &mut Vec<f32>, n: usize| {
            buffer.clear();
            buffer.resize(n, 0.0);
        };
        for it in &mut self.histograms {
            fit(it, N_ORIENTATIONS * stride);
        }
        for it in self.energies.iter_mut().chain(&mut self.norms) {
            fit(it, stride);
        }
    }
}

/// Length of a row of cells in memory. It is so long that a register that begins at the last cell is still inside the row.
fn stride(cols: usize) -> usize {
    cols.next_multiple_of(LANES) + LANES
}

pub(super) struct Hog<'a> {
    pub(super) image: &'a Planes,
    pub(super) shape: HogShape,
    pub(super) workspace: &'a mut HogWorkspace,
    pub(super) out: &'a mut [f32],
}

impl Body for Hog<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            image,
            shape,
            workspace,
            out,
        } = self;
        let [rows, cols] = shape.cells(image.width(), image.height());
        let (map, _) = out.as_chunks_mut::<N_CHANNELS>();
        let Some([inner_rows, inner_cols]) = shape.pad_map([rows, cols], map) else {
            return;
        };
        let stride = stride(cols);
        workspace.prepare(stride);
        workspace.votes.prepare(shape.cell_px, cols);
        let map_cols = inner_cols + 2 * shape.pad[1];
        for block in 0..=rows {
            workspace.votes.count(image, block, [rows, cols]);
            let next = block % 3;
            if let Some(row) = block.checked_sub(1) {
                workspace.votes.add_upper(&mut workspace.histograms[row % 3], stride);
                workspace.energies_of(row, stride);
                if (2..inner_rows + 2).contains(&row) {
                    let line = (row - 2 + shape.pad[0]) * map_cols + shape.pad[1];
                    workspace.features_above(row, stride, &mut map[line..][..inner_cols]);
                }
            }
            workspace.votes.put_lower(&mut workspace.histograms[next], stride);
        }
    }
}

impl HogWorkspace {
    /// Computes the energies of a finished row of cells, and the norms of the blocks that are complete with this row.
    #[inline(always)]
    fn energies_of(&mut self, row: usize, stride: usize) {
        let [first, second] = &mut self.energies;
        let (above, here) = if row.is_multiple_of(2) {
            (second, first)
        } else {
            (first, second)
        };
        let histogram = &self.histograms[row % 3];
        here.fill(0.0);
        for o in 0..N_UNSIGNED {
            let (a, b) = (
                line(histogram, o, stride),
                line(histogram, o + N_UNSIGNED, stride),
            );
            for ((sum, a), b) in here.iter_mut().zip(a).zip(b) {
                let both = a + b;
                *sum += both * both;
            }
        }
        let pairs = above[..stride - 1].iter().zip(&above[1..]);
        let pairs = pairs.zip(here[..stride - 1].iter().zip(&here[1..]));
        for (norm, ((a, b), (c, d))) in self.norms[(row + 1) % 2].iter_mut().zip(pairs) {
            *norm = 1.0 / (a + b + c + d + FLAT as f32).sqrt();
        }
    }

    /// Computes the features of the row above `row`, for all its cells except the first and the last.
    #[inline(always)]
    fn features_above(&self, row: usize, stride: usize, out: &mut [[f32; N_CHANNELS]]) {
        let histogram = &self.histograms[(row - 1) % 3];
        let (above, below) = (&self.norms[row % 2], &self.norms[(row + 1) % 2]);
        let (mut x, n) = (0, out.len());
        while x < n {
            let norms = [
                load(&below[x + 1..]),
                load(&above[x + 1..]),
                load(&below[x..]),
                load(&above[x..]),
            ];
            let mut channels = [[0.0; LANES]; N_CHANNELS];
            normalise(&histogram[x + 1..], stride, &norms, &mut channels);
            let end = n.min(x + LANES);
            transpose(&channels, &mut out[x..end]);
            x = end;
        }
    }
}

#[inline(always)]
fn line(histogram: &[f32], orientation: usize, stride: usize) -> &[f32] {
    &histogram[orientation * stride..][..stride]
}

#[inline(always)]
fn load(from: &[f32]) -> Lanes {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&from[..LANES]);
    lanes
}

#[inline(always)]
fn normalise(
    histogram: &[f32],
    stride: usize,
    norms: &[Lanes; 4],
    channels: &mut [Lanes; N_CHANNELS],
) {
    let mut texture = [[0.0; LANES]; 4];
    for o in 0..N_ORIENTATIONS {
        let value = load(&histogram[o * stride..]);
        channels[o] = clipped_sum(&value, norms, &mut texture);
    }
    let mut unused = [[0.0; LANES]; 4];
    for o in 0..N_UNSIGNED {
        let (mut value, back) = (
            load(&histogram[o * stride..]),
            load(&histogram[(o + N_UNSIGNED) * stride..]),
        );
        for lane in 0..LANES {
            value[lane] += back[lane];
        }
        channels[N_ORIENTATIONS + o] = clipped_sum(&value, norms, &mut unused);
    }
    for (channel, sum) in channels[N_ORIENTATIONS + N_UNSIGNED..].iter_mut().zip(texture) {
        *channel = sum.map(|sum| TEXTURE as f32 * sum);
    }
}

/// Multiplies `value` by each norm, clips each product, and returns half their sum. Every product is also added to `sums`.
#[inline(always)]
fn clipped_sum(value: &Lanes, norms: &[Lanes; 4], sums: &mut [Lanes; 4]) -> Lanes {
    let mut channel = [0.0; LANES];
    for (norm, sum) in norms.iter().zip(sums) {
        for lane in 0..LANES {
            let term = value[lane] * norm[lane];
            let term = if term < CLIP as f32 {
                term
            } else {
                CLIP as f32
            };
            sum[lane] += term;
            channel[lane] += term;
        }
    }
    channel.map(|channel| 0.5 * channel)
}

/// Writes the channels of the cells, one cell after the other.
#[inline(always)]
fn transpose(channels: &[Lanes; N_CHANNELS], out: &mut [[f32; N_CHANNELS]]) {
    for (lane, cell) in out.iter_mut().enumerate() {
        for (value, channel) in cell.iter_mut().zip(channels) {
            *value = channel[lane];
        }
    }
}
