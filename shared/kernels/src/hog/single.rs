//! The features as they ship: decided in double, summed and normalised in single precision.

use super::{CLIP, FLAT, HogShape, N_CHANNELS, TEXTURE, Vote};
use crate::Planes;
use crate::gradient::{GradientRow, N_ORIENTATIONS};
use crate::isa::{Isa, Kind};

const N_UNSIGNED: usize = N_ORIENTATIONS / 2;
const CLIP_F32: f32 = CLIP as f32;

/// Buffers of [`hog`], used again from image to image.
#[derive(Debug, Default)]
pub struct HogWorkspace {
    gradients: GradientRow,
    /// Length of the gradient and orientation of every pixel of the row.
    votes: Vec<(f32, u32)>,
    /// `(rows + 2) x (cols + 2)` cells: the ring takes votes that fall outside.
    histograms: Vec<[f32; N_ORIENTATIONS]>,
    /// Energies of the cells, then norms of the blocks; `rows x cols`.
    norms: Vec<f32>,
    energies: Vec<f32>,
}

/// Writes the features of `image` with their padding.
///
/// As [`hog_f64`](super::hog_f64): the orientation of every gradient is decided in double
/// precision, and everything after it is single precision, so the values differ by rounding only.
///
/// * `out`: `rows x cols x N_CHANNELS` of [`HogShape::map_size`]; overwritten.
///
/// # Panics
///
/// If `out` has another size, or a side of the image is shorter than 3 pixels.
pub fn hog(
    isa: Isa,
    image: &Planes,
    shape: HogShape,
    workspace: &mut HogWorkspace,
    out: &mut [f32],
) {
    let [rows, cols] = shape.map_size(image.width(), image.height());
    assert_eq!(
        out.len(),
        rows * cols * N_CHANNELS,
        "one cell per map entry"
    );
    assert!(
        image.width().min(image.height()) >= 3,
        "central differences"
    );
    match isa.0 {
        Kind::Portable => body(image, shape, workspace, out),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
        Kind::Avx2 => unsafe { avx2(image, shape, workspace, out) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
        Kind::Avx512 => unsafe { avx512(image, shape, workspace, out) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(image: &Planes, shape: HogShape, workspace: &mut HogWorkspace, out: &mut [f32]) {
    body(image, shape, workspace, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn avx512(image: &Planes, shape: HogShape, workspace: &mut HogWorkspace, out: &mut [f32]) {
    body(image, shape, workspace, out);
}

#[inline(always)]
fn body(image: &Planes, shape: HogShape, workspace: &mut HogWorkspace, out: &mut [f32]) {
    let cells = shape.cells(image.width(), image.height());
    sum_votes(image, shape.cell_px, cells, workspace);
    let HogWorkspace {
        histograms,
        norms,
        energies,
        ..
    } = workspace;
    let [rows, cols] = cells;
    block_norms(histograms, cells, energies, norms);
    pad(shape, cells, out);
    let map_cols = cols.saturating_sub(2) + 2 * shape.pad[1];
    for y in 0..rows.saturating_sub(2) {
        let line = ((y + shape.pad[0]) * map_cols + shape.pad[1]) * N_CHANNELS;
        let (line, _) = out[line..].as_chunks_mut::<N_CHANNELS>();
        let histograms = &histograms[(y + 2) * (cols + 2) + 2..][..cols.saturating_sub(2)];
        let (above, below) = (&norms[y * cols..][..cols], &norms[(y + 1) * cols..][..cols]);
        for (x, (cell, histogram)) in line.iter_mut().zip(histograms).enumerate() {
            normalise(
                histogram,
                [below[x + 1], above[x + 1], below[x], above[x]],
                cell,
            );
        }
    }
}

#[inline(always)]
fn sum_votes(
    image: &Planes,
    cell_px: usize,
    [rows, cols]: [usize; 2],
    workspace: &mut HogWorkspace,
) {
    let stride = cols + 2;
    let histograms = &mut workspace.histograms;
    histograms.clear();
    histograms.resize((rows + 2) * stride, [0.0; N_ORIENTATIONS]);
    let last = [image.height() - 2, image.width() - 2];
    for y in 1..(rows * cell_px).saturating_sub(1) {
        if y <= last[0] {
            workspace.gradients.compute(image, y);
            let row = &workspace.gradients;
            let pixels = row.squared.iter().zip(&row.bin);
            workspace.votes.clear();
            workspace
                .votes
                .extend(pixels.map(|(it, bin)| ((*it as f32).sqrt(), *bin as u32)));
        }
        let down = Vote::of(y, cell_px);
        let (upper, lower) = histograms[down.cell * stride..].split_at_mut(stride);
        let shares = down.share.map(|it| it as f32);
        vote_along(&workspace.votes, [cell_px, cols], shares, [upper, lower]);
    }
}

/// Adds the votes of one row of pixels to the two rows of cells around it.
#[inline(always)]
fn vote_along(
    votes: &[(f32, u32)],
    [cell_px, cols]: [usize; 2],
    down: [f32; 2],
    [upper, lower]: [&mut [[f32; N_ORIENTATIONS]]; 2],
) {
    let last = votes.len() - 2;
    for x in 1..(cols * cell_px).saturating_sub(1) {
        let (length, bin) = votes[x.min(last)];
        let bin = (bin as usize).min(N_ORIENTATIONS - 1);
        let along = Vote::of(x, cell_px);
        let [here, next] = along.share.map(|it| it as f32);
        upper[along.cell][bin] += here * down[0] * length;
        upper[along.cell + 1][bin] += next * down[0] * length;
        lower[along.cell][bin] += here * down[1] * length;
        lower[along.cell + 1][bin] += next * down[1] * length;
    }
}

/// Norms of the blocks of 2 x 2 cells, at their top left cell.
#[inline(always)]
fn block_norms(
    histograms: &[[f32; N_ORIENTATIONS]],
    [rows, cols]: [usize; 2],
    energies: &mut Vec<f32>,
    norms: &mut Vec<f32>,
) {
    energies.clear();
    for line in histograms.chunks_exact(cols + 2).skip(1).take(rows) {
        energies.extend(line[1..=cols].iter().map(energy));
    }
    norms.clear();
    norms.resize(rows * cols, 0.0);
    for y in 0..rows.saturating_sub(1) {
        let (above, below) = (
            &energies[y * cols..][..cols],
            &energies[(y + 1) * cols..][..cols],
        );
        let line = &mut norms[y * cols..][..cols];
        for x in 0..cols.saturating_sub(1) {
            let block = above[x] + above[x + 1] + below[x] + below[x + 1];
            line[x] = 1.0 / (block + FLAT as f32).sqrt();
        }
    }
}

#[inline(always)]
fn energy(histogram: &[f32; N_ORIENTATIONS]) -> f32 {
    let mut sum = 0.0;
    for o in 0..N_UNSIGNED {
        let both = histogram[o] + histogram[o + N_UNSIGNED];
        sum += both * both;
    }
    sum
}

#[inline(always)]
fn normalise(histogram: &[f32; N_ORIENTATIONS], norms: [f32; 4], cell: &mut [f32; N_CHANNELS]) {
    let mut texture = [0.0; 4];
    for &value in histogram {
        for (sum, norm) in texture.iter_mut().zip(norms) {
            *sum += clip(value * norm);
        }
    }
    for (channel, &value) in cell[..N_ORIENTATIONS].iter_mut().zip(histogram) {
        *channel = clipped_sum(value, norms);
    }
    for o in 0..N_UNSIGNED {
        let value = histogram[o] + histogram[o + N_UNSIGNED];
        cell[N_ORIENTATIONS + o] = clipped_sum(value, norms);
    }
    for (channel, sum) in cell[N_ORIENTATIONS + N_UNSIGNED..].iter_mut().zip(texture) {
        *channel = TEXTURE as f32 * sum;
    }
    cell[N_CHANNELS - 1] = 0.0;
}

#[inline(always)]
fn clipped_sum(value: f32, [a, b, c, d]: [f32; 4]) -> f32 {
    0.5 * (clip(value * a) + clip(value * b) + clip(value * c) + clip(value * d))
}

#[inline(always)]
fn clip(value: f32) -> f32 {
    if value < CLIP_F32 { value } else { CLIP_F32 }
}

/// Fills the padding; the inside is left as it is.
#[inline(always)]
fn pad(shape: HogShape, [rows, cols]: [usize; 2], out: &mut [f32]) {
    let [pad_rows, pad_cols] = shape.pad;
    let inside = [rows.saturating_sub(2), cols.saturating_sub(2)];
    let map_cols = inside[1] + 2 * pad_cols;
    let mut padding = [0.0; N_CHANNELS];
    padding[N_CHANNELS - 1] = 1.0;
    let (map, _) = out.as_chunks_mut::<N_CHANNELS>();
    for (y, line) in map.chunks_exact_mut(map_cols.max(1)).enumerate() {
        if (pad_rows..pad_rows + inside[0]).contains(&y) {
            line[..pad_cols].fill(padding);
            line[pad_cols + inside[1]..].fill(padding);
        } else {
            line.fill(padding);
        }
    }
}
