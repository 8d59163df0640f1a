//! Products of matrices, and sums in an order that does not depend on the number of threads.

use nalgebra::{Dyn, MatrixView, MatrixViewMut};

/// A matrix stored row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    is_transposed: bool,
}

/// A view with any strides between rows and between columns.
type View<'a> = MatrixView<'a, f32, Dyn, Dyn, Dyn, Dyn>;

impl<'a> Matrix<'a> {
    /// A matrix of the given values, with rows of the given length.
    pub(super) fn new(values: &'a [f32], columns: usize) -> Self {
        Self {
            values,
            rows: values.len() / columns,
            columns,
            is_transposed: false,
        }
    }

    /// The transposed matrix.
    pub(super) fn transposed(self) -> Self {
        Self {
            is_transposed: !self.is_transposed,
            ..self
        }
    }

    fn view(self) -> View<'a> {
        let (rows, columns) = (Dyn(self.rows), Dyn(self.columns));
        if self.is_transposed {
            let (across, down) = (Dyn(1), Dyn(self.columns));
            return View::from_slice_with_strides_generic(self.values, columns, rows, across, down);
        }
        let (across, down) = (Dyn(self.columns), Dyn(1));
        View::from_slice_with_strides_generic(self.values, rows, columns, across, down)
    }
}

/// Largest side for which products are computed here.
///
/// nalgebra multiplies matrices with fewer than six rows or columns column by column. Its result is wrong if the values of a
/// column are not contiguous (version 0.35 reads and writes outside the column). Larger matrices are multiplied by `matrixmultiply`.
const SMALL: usize = 5;

/// Adds the product of two matrices to a third, which is stored row by row.
pub(super) fn add_product(sum: &mut [f32], a: Matrix<'_>, b: Matrix<'_>) {
    let (view_of_a, view_of_b) = (a.view(), b.view());
    let (rows, inner, columns) = (view_of_a.nrows(), view_of_a.ncols(), view_of_b.ncols());
    assert_eq!(
        inner,
        view_of_b.nrows(),
        "the sizes of the matrices must match"
    );
    assert_eq!(sum.len(), rows * columns, "room for the product");
    if rows.min(inner).min(columns) <= SMALL {
        return add_small_product(sum, a, b);
    }
    let (across, down) = (Dyn(columns), Dyn(1));
    let sizes = (Dyn(rows), Dyn(columns));
    let mut sum: MatrixViewMut<'_, f32, Dyn, Dyn, Dyn, Dyn> =
        MatrixViewMut::from_slice_with_strides_generic(sum, sizes.0, sizes.1, across, down);
    sum.gemm(1.0, &view_of_a, &view_of_b, 1.0);
}

fn add_small_product(sum: &mut [f32], a: Matrix<'_>, b: Matrix<'_>) {
    let (from, columns) = (a.view(), b.view().ncols());
    for (row, sum) in sum.chunks_exact_mut(columns).enumerate() {
        let factors = (0..from.ncols()).map(|at| from[(row, at)]);
        if b.is_transposed {
            let factors: Vec<f32> = factors.collect();
            let rows = b.values.chunks_exact(b.columns);
            for (sum, row) in sum.iter_mut().zip(rows) {
                *sum += dot(&factors, row);
            }
        } else {
            for (factor, row) in factors.zip(b.values.chunks_exact(b.columns)) {
                for (sum, value) in sum.iter_mut().zip(row) {
                    *sum += factor * value;
                }
            }
        }
    }
}

/// Number of partial sums, so that processors can add several values at once.
const LANES: usize = 16;

/// The sum of a function of corresponding values in two lists.
pub(super) fn sum_of(a: &[f32], b: &[f32], of: impl Fn(f32, f32) -> f32) -> f32 {
    let mut sums = [0.0; LANES];
    let (a, rest_of_a) = a.as_chunks::<LANES>();
    let (b, rest_of_b) = b.as_chunks::<LANES>();
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += of(a[lane], b[lane]);
        }
    }
    let rest = rest_of_a.iter().zip(rest_of_b);
    sums.iter().sum::<f32>() + rest.map(|(a, b)| of(*a, *b)).sum::<f32>()
}

/// The sum of numbers.
pub(super) fn sum(values: &[f32]) -> f32 {
    sum_of(values, values, |value, _| value)
}

/// The dot product of two lists.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f32 {
    sum_of(a, b, |a, b| a * b)
}

/// Adds a list to another.
pub(super) fn add_to(sum: &mut [f32], values: &[f32]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrix_products_of_all_shapes_equal_plain_loops() {
        let values = |n: usize, step: f32| -> Vec<f32> {
            (0..n).map(|at| (at as f32 * step).sin()).collect()
        };
        for rows in [1, 2, 5, 6, 7, 18] {
            for inner in [1, 3, 6, 9, 40] {
                for columns in [1, 3, 5, 6, 8, 17] {
                    let a = values(rows * inner, 0.7);
                    let b = values(inner * columns, 0.9);
                    let (of_a, of_b) = (Matrix::new(&a, inner), Matrix::new(&b, columns));
                    let mut product = vec![1.0; rows * columns];
                    add_product(&mut product, of_a, of_b);
                    let mut turned = vec![1.0; rows * columns];
                    add_product(&mut turned, of_b.transposed(), of_a.transposed());
                    for row in 0..rows {
                        for column in 0..columns {
                            let expected = (0..inner).fold(1.0, |sum, at| {
                                sum + a[row * inner + at] * b[at * columns + column]
                            });
                            let of = [product[row * columns + column], turned[column * rows + row]];
                            for value in of {
                                assert!(
                                    (value - expected).abs() < 1e-4,
                                    "{rows} {inner} {columns}: {value}, {expected}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}
