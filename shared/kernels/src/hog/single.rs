//! The features in single precision, in readable form: the same bits as those of the fast version.

use super::{CLIP, FLAT, HogShape, N_CHANNELS, N_UNSIGNED, TEXTURE, Vote};
use crate::Planes;
use crate::gradient::{N_ORIENTATIONS, gradient};

type Histogram = [f32; N_ORIENTATIONS];

/// Readable version of [`hog`](super::hog()).
pub(super) fn hog_f32(image: &Planes, shape: HogShape) -> Vec<f32> {
    let [map_rows, map_cols] = shape.map_size(image.width(), image.height());
    let mut map = vec![[f32::NAN; N_CHANNELS]; map_rows * map_cols];
    let [rows, cols] = shape.cells(image.width(), image.height());
    let Some([inner_rows, inner_cols]) = shape.pad_map([rows, cols], &mut map) else {
        return map.concat();
    };
    let histograms = histograms(image, shape.cell_px, [rows, cols]);
    let energy = |y: usize, x: usize| energy(&histograms[y * cols + x]);
    let norm = |y: usize, x: usize| {
        let block = energy(y, x) + energy(y, x + 1) + energy(y + 1, x) + energy(y + 1, x + 1);
        1.0 / (block + FLAT as f32).sqrt()
    };
    for y in 0..inner_rows {
        for x in 0..inner_cols {
            let norms = [
                norm(y + 1, x + 1),
                norm(y, x + 1),
                norm(y + 1, x),
                norm(y, x),
            ];
            let at = (y + shape.pad[0]) * map_cols + x + shape.pad[1];
            normalise(&histograms[(y + 1) * cols + x + 1], norms, &mut map[at]);
        }
    }
    map.concat()
}

/// Histograms of all cells. A cell adds the votes for lower cells from the blocks above it, then the votes for upper cells from the blocks
/// below it.
fn histograms(image: &Planes, cell_px: usize, [rows, cols]: [usize; 2]) -> Vec<Histogram> {
    let blocks: Vec<_> = (0..(rows + 1) * (cols + 1))
        .map(|at| {
            let block = [at / (cols + 1), at % (cols + 1)];
            votes_of_block(image, cell_px, block, [rows, cols])
        })
        .collect();
    let cell = |at: usize| {
        let (y, x) = (at / cols, at % cols);
        let [above, below] = [y, y + 1].map(|y| &blocks[y * (cols + 1) + x..][..2]);
        std::array::from_fn(|o| {
            (above[0][1][1][o] + above[1][1][0][o]) + (below[0][0][1][o] + below[1][0][0][o])
        })
    };
    (0..rows * cols).map(cell).collect()
}

/// Returns the votes of the pixels between four cell centres for each of the four cells, `[below?][right?]`.
fn votes_of_block(
    image: &Planes,
    cell_px: usize,
    block: [usize; 2],
    cells: [usize; 2],
) -> [[Histogram; 2]; 2] {
    let mut sums = [[[0.0; N_ORIENTATIONS]; 2]; 2];
    // A pixel outside of 1..=last does not vote.
    let [ys, xs] = [0, 1].map(|axis| {
        let first = block[axis] * cell_px;
        let pixels = (first..first + cell_px).filter_map(move |i| {
            let pixel = i.checked_sub(cell_px.div_ceil(2))?;
            (1..=cells[axis] * cell_px - 2).contains(&pixel).then_some(pixel)
        });
        pixels.map(move |pixel| {
            (
                pixel,
                Vote::of(cell_px / 2 + pixel + cell_px.div_ceil(2) - first, cell_px).share,
            )
        })
    });
    for (y, down) in ys {
        for (x, along) in xs.clone() {
            let at = [y.min(image.height() - 2), x.min(image.width() - 2)];
            let (squared, bin) = gradient(image, at[0], at[1]);
            let length = (squared as f32).sqrt();
            for (sums, down) in sums.iter_mut().zip(down) {
                for (sums, along) in sums.iter_mut().zip(along) {
                    sums[bin] += along as f32 * down as f32 * length;
                }
            }
        }
    }
    sums
}

fn energy(histogram: &Histogram) -> f32 {
    let both = |o: usize| histogram[o] + histogram[o + N_UNSIGNED];
    (0..N_UNSIGNED).fold(0.0, |sum, o| sum + both(o) * both(o))
}

fn normalise(histogram: &Histogram, norms: [f32; 4], cell: &mut [f32; N_CHANNELS]) {
    let clipped = |value: f32| norms.map(|norm| (value * norm).min(CLIP as f32));
    let sum = |[a, b, c, d]: [f32; 4]| a + b + c + d;
    let texture = |k: usize| histogram.iter().fold(0.0, |sum, &it| sum + clipped(it)[k]);
    for o in 0..N_ORIENTATIONS {
        cell[o] = 0.5 * sum(clipped(histogram[o]));
    }
    for o in 0..N_UNSIGNED {
        let both = histogram[o] + histogram[o + N_UNSIGNED];
        cell[N_ORIENTATIONS + o] = 0.5 * sum(clipped(both));
    }
    for k in 0..4 {
        cell[N_ORIENTATIONS + N_UNSIGNED + k] = TEXTURE as f32 * texture(k);
    }
    cell[N_CHANNELS - 1] = 0.0;
}
