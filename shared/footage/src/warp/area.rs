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
    columns: Columns,
    rows: Vec<Cover>,
    divisor: f32,
    /// Weighted sum of the source rows that an output row covers.
    sums: Vec<f32>,
    /// Weighted sum of the source pixels that each output pixel of a row covers.
    totals: Vec<f32>,
}

/// The covers of all columns, with the same number of weights for each. Weights of 0 are added before or after the others.
#[derive(Debug, Clone)]
struct Columns {
    /// For each output column, the index of its first value in a row of the source.
    first: Vec<usize>,
    n_weights: usize,
    weights: Vec<f32>,
}

impl Area {
    /// Prepares the area means.
    ///
    /// * `axes`: factor and shift of x, and factor and shift of y. The factors have an absolute value of at least 1.
    pub(super) fn new(source: Size, output: Size, axes: [[f64; 2]; 2], fill: Fill) -> Self {
        let [x_axis, y_axis] = axes;
        let cover = |n_output: usize, axis: [f64; 2], n_source: usize| -> Vec<Cover> {
            (0..n_output)
                .map(|at| Cover::new(axis[0] * at as f64 + axis[1], axis[0].abs(), n_source, fill))
                .collect()
        };
        Self {
            columns: Columns::new(&cover(output.width, x_axis, source.width), source.width),
            rows: cover(output.height, y_axis, source.height),
            divisor: (x_axis[0] * y_axis[0]).abs() as f32,
            sums: vec![0.0; source.width * 3],
            totals: vec![0.0; output.width * 3],
        }
    }

    #[inline(always)]
    pub(super) fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        let stride = self.sums.len();
        let out_rows = out.chunks_exact_mut(self.totals.len());
        for (cover, out_row) in self.rows.iter().zip(out_rows) {
            self.sums.fill(0.0);
            let rows = source[cover.first * stride..].chunks_exact(stride);
            for (&weight, row) in cover.weights.iter().zip(rows) {
                for (sum, &value) in self.sums.iter_mut().zip(row) {
                    *sum += weight * f32::from(value);
                }
            }
            self.columns.add_up(&self.sums, &mut self.totals);
            // A sum of integers is exact below 2^24, and its quotient is correctly rounded. Integer factors therefore give the true mean.
            for (value, total) in out_row.iter_mut().zip(&self.totals) {
                *value = (total / self.divisor + 0.5) as u8;
            }
        }
    }
}

impl Columns {
    fn new(covers: &[Cover], n_source: usize) -> Self {
        let n_weights = covers.iter().map(|cover| cover.weights.len()).max().unwrap_or(0);
        let mut columns = Self {
            first: Vec::with_capacity(covers.len()),
            n_weights,
            weights: vec![0.0; n_weights * covers.len()],
        };
        let rows = columns.weights.chunks_exact_mut(n_weights.max(1));
        for (cover, row) in covers.iter().zip(rows) {
            let first = cover.first.min(n_source - n_weights);
            row[cover.first - first..][..cover.weights.len()].copy_from_slice(&cover.weights);
            columns.first.push(3 * first);
        }
        columns
    }

    /// Adds up the values of a row that the output pixels cover.
    #[inline(always)]
    fn add_up(&self, row: &[f32], totals: &mut [f32]) {
        match self.n_weights {
            2 => self.add_up_few::<2>(row, totals),
            3 => self.add_up_few::<3>(row, totals),
            4 => self.add_up_few::<4>(row, totals),
            n => {
                let totals = totals.as_chunks_mut::<3>().0;
                let covers = self.first.iter().zip(self.weights.chunks_exact(n.max(1)));
                for ((first, weights), total) in covers.zip(totals) {
                    *total = sum(weights, &row[*first..]);
                }
            }
        }
    }

    /// The same with a number of weights that the compiler knows.
    #[inline(always)]
    fn add_up_few<const N: usize>(&self, row: &[f32], totals: &mut [f32]) {
        let covers = self.first.iter().zip(self.weights.as_chunks::<N>().0);
        for ((first, weights), total) in covers.zip(totals.as_chunks_mut::<3>().0) {
            *total = sum(weights, &row[*first..][..3 * N]);
        }
    }
}

/// Returns the weighted sum of pixels.
#[inline(always)]
fn sum(weights: &[f32], pixels: &[f32]) -> [f32; 3] {
    let mut total = [0.0; 3];
    for (weight, pixel) in weights.iter().zip(pixels.as_chunks::<3>().0) {
        for (total, value) in total.iter_mut().zip(pixel) {
            *total += weight * value;
        }
    }
    total
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
}
