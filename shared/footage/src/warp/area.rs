//! The exact area mean, for maps that keep rows and columns.

use super::Fill;
use crate::Size;

/// The source pixels that one output coordinate covers, and the covered fraction of each.
#[derive(Debug, Clone, PartialEq)]
struct Cover {
    first: usize,
    weights: Vec<f32>,
}

/// The covers of rows and columns. A pixel is the weighted sum over both, divided by the area.
#[derive(Debug, Clone)]
pub(super) struct Area {
    columns: Vec<Cover>,
    rows: Vec<Cover>,
    divisor: f32,
    /// Weighted sum of the source rows that an output row covers.
    sums: Vec<f32>,
}

impl Area {
    /// Prepares the area means.
    ///
    /// * `axes`: factor and shift of x, and factor and shift of y. The factors have an absolute value of at least 1.
    pub(super) fn new(source: Size, output: Size, axes: [[f64; 2]; 2], fill: Fill) -> Self {
        let [x_axis, y_axis] = axes;
        let cover = |n_output: usize, axis: [f64; 2], n_source: usize| {
            (0..n_output)
                .map(|at| Cover::new(axis[0] * at as f64 + axis[1], axis[0].abs(), n_source, fill))
                .collect()
        };
        Self {
            columns: cover(output.width, x_axis, source.width),
            rows: cover(output.height, y_axis, source.height),
            divisor: (x_axis[0] * y_axis[0]).abs() as f32,
            sums: vec![0.0; source.width * 3],
        }
    }

    #[inline(always)]
    pub(super) fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        let stride = self.sums.len();
        let out_rows = out.chunks_exact_mut(self.columns.len() * 3);
        for (cover, out_row) in self.rows.iter().zip(out_rows) {
            self.sums.fill(0.0);
            let rows = source[cover.first * stride..].chunks_exact(stride);
            for (&weight, row) in cover.weights.iter().zip(rows) {
                for (sum, &value) in self.sums.iter_mut().zip(row) {
                    *sum += weight * f32::from(value);
                }
            }
            for (cover, pixel) in self.columns.iter().zip(out_row.as_chunks_mut().0) {
                *pixel = cover.mean(&self.sums, self.divisor);
            }
        }
    }
}

impl Cover {
    /// Returns the cover of one output coordinate.
    ///
    /// * `centre`: position of the output coordinate in the source.
    /// * `width`: covered width.
    fn new(centre: f64, width: f64, n_source: usize, fill: Fill) -> Self {
        // Edges of the cover, in units where source pixel `i` covers `[i, i + 1]`.
        let low = centre + 0.5 - width / 2.0;
        let high = low + width;
        let last = n_source as f64 - 1.0;
        let [first, end] = match fill {
            Fill::Black => [low.floor().max(0.0), high.ceil().min(last + 1.0)],
            Fill::Replicate => [
                low.floor().clamp(0.0, last),
                high.ceil().clamp(1.0, last + 1.0),
            ],
        };
        let (first, end) = (first.min(last) as usize, end.max(0.0) as usize);
        let weights = (first..end)
            .map(|pixel| {
                let mut sides = [pixel as f64, pixel as f64 + 1.0];
                if fill == Fill::Replicate {
                    // The pixels of the border extend without limit.
                    sides[0] = if pixel == 0 {
                        f64::NEG_INFINITY
                    } else {
                        sides[0]
                    };
                    sides[1] = if pixel + 1 == n_source {
                        f64::INFINITY
                    } else {
                        sides[1]
                    };
                }
                (high.min(sides[1]) - low.max(sides[0])).max(0.0) as f32
            })
            .collect();
        Self { first, weights }
    }

    #[inline(always)]
    fn mean(&self, sums: &[f32], area: f32) -> [u8; 3] {
        let mut total = [0.0; 3];
        let pixels = sums[self.first * 3..].as_chunks::<3>().0;
        for (weight, pixel) in self.weights.iter().zip(pixels) {
            for (total, value) in total.iter_mut().zip(pixel) {
                *total += weight * value;
            }
        }
        // A sum of integers is exact below 2^24, and its quotient is correctly rounded. Integer factors
        // therefore give the true mean.
        total.map(|sum| (sum / area + 0.5) as u8)
    }
}
