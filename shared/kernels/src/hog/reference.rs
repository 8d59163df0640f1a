//! The features in double precision, in readable form.

use super::{CLIP, FLAT, HogShape, N_CHANNELS, N_UNSIGNED, TEXTURE, Vote};
use crate::Planes;
use crate::gradient::{N_ORIENTATIONS, gradient};

/// Features of `image` with their padding, `rows x cols x N_CHANNELS` of [`HogShape::map_size`].
///
/// Each pixel votes with the length of its gradient, which is divided bilinearly between the four nearest cells.
/// A cell's histogram is normalised by the energies of the four blocks of 2 x 2 cells that contain the cell.
/// Each result is clipped at 0.2.
pub fn hog_f64(image: &Planes, shape: HogShape) -> Vec<f64> {
    let [rows, cols] = shape.cells(image.width(), image.height());
    let histograms = histograms(image, shape.cell_px, [rows, cols]);
    let energy = |y: usize, x: usize| energy(&histograms[y * cols + x]);
    let norm = |y: usize, x: usize| {
        let block = energy(y, x) + energy(y, x + 1) + energy(y + 1, x) + energy(y + 1, x + 1);
        1.0 / (block + FLAT).sqrt()
    };
    let [map_rows, map_cols] = shape.map_size(image.width(), image.height());
    let mut padding = [0.0; N_CHANNELS];
    padding[N_CHANNELS - 1] = 1.0;
    let mut map = padding.repeat(map_rows * map_cols);
    for y in 0..rows.saturating_sub(2) {
        for x in 0..cols.saturating_sub(2) {
            let norms = [
                norm(y + 1, x + 1),
                norm(y, x + 1),
                norm(y + 1, x),
                norm(y, x),
            ];
            let at = (y + shape.pad[0]) * map_cols + x + shape.pad[1];
            let cell = &mut map[at * N_CHANNELS..][..N_CHANNELS];
            normalise(&histograms[(y + 1) * cols + x + 1], norms, cell);
        }
    }
    map
}

type Histogram = [f64; N_ORIENTATIONS];

fn histograms(image: &Planes, cell_px: usize, [rows, cols]: [usize; 2]) -> Vec<Histogram> {
    let mut all = vec![[0.0; N_ORIENTATIONS]; rows * cols];
    for y in 1..(rows * cell_px).saturating_sub(1) {
        let down = Vote::of(y, cell_px);
        for x in 1..(cols * cell_px).saturating_sub(1) {
            let pixel = [y.min(image.height() - 2), x.min(image.width() - 2)];
            let (squared, bin) = gradient(image, pixel[0], pixel[1]);
            let length = squared.sqrt();
            let along = Vote::of(x, cell_px);
            for (dy, share_y) in down.share.iter().enumerate() {
                for (dx, share_x) in along.share.iter().enumerate() {
                    let (y, x) = (down.cell + dy, along.cell + dx);
                    if (1..=rows).contains(&y) && (1..=cols).contains(&x) {
                        let cell = &mut all[(y - 1) * cols + x - 1];
                        cell[bin] += share_x * share_y * length;
                    }
                }
            }
        }
    }
    all
}

fn energy(histogram: &Histogram) -> f64 {
    let both = |o: usize| histogram[o] + histogram[o + N_UNSIGNED];
    (0..N_UNSIGNED).map(|o| both(o) * both(o)).sum()
}

fn normalise(histogram: &Histogram, norms: [f64; 4], cell: &mut [f64]) {
    let mut texture = [0.0; 4];
    for (o, value) in histogram.iter().enumerate() {
        let clipped = norms.map(|norm| (value * norm).min(CLIP));
        cell[o] = 0.5 * clipped.iter().sum::<f64>();
        for (sum, it) in texture.iter_mut().zip(clipped) {
            *sum += it;
        }
    }
    for o in 0..N_UNSIGNED {
        let value = histogram[o] + histogram[o + N_UNSIGNED];
        let clipped = norms.map(|norm| (value * norm).min(CLIP));
        cell[N_ORIENTATIONS + o] = 0.5 * clipped.iter().sum::<f64>();
    }
    for (target, sum) in cell[N_ORIENTATIONS + N_UNSIGNED..].iter_mut().zip(texture) {
        *target = TEXTURE * sum;
    }
    cell[N_CHANNELS - 1] = 0.0;
}
