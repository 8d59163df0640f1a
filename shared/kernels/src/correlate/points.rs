//! The matrices of Toom-Cook correlation, computed from the interpolation points.

/// Maximum number of values in a line of a tile.
pub(super) const MAX_TILE: usize = 10;
/// Maximum number of pairs of points.
const MAX_PAIRS: usize = 4;

/// Points `0, p, -p, q, -q, .., infinity` for tiles of `2 pairs + 2` values, as polynomials.
///
/// Correlating `d` with `g` is the transpose of multiplying polynomials, which can be done by values at points: `y = A^T ((G g) . (B^T
/// d))`, where `A` and `G` contain the powers of the points (Winograd, *Arithmetic Complexity of Computations*, 1980; Lavin & Gray, *Fast
/// Algorithms for Convolutional Neural Networks*, 2016). The rows of `B^T` contain the coefficients of the polynomials that vanish at all
/// other points. The divisors are part of `G`, which is only used in double precision. With `w(z) = (z - p^2)(z - q^2)..` and `v_p(z) =
/// w(z) / (z - p^2)`, the rows are `w(x^2)` for 0, `x w(x^2)` for infinity, and `x^2 v_p(x^2) + p x v_p(x^2)` for `p`. The even and the odd
/// values of a line are therefore combined only in the last addition.
///
/// All numbers here are exact in single precision: the points are `1`, `2`, `1/2` for tiles of 8 and `1`, `5/2`, `5/4`, `5/16` for tiles of
/// 10. For tiles of 10, sets of fractions up to 4 were tried. The set with `1/4` in place of `5/16` has the smallest
///     [`amplification`](Self::amplification). The amplification of the chosen set is at most a twentieth larger, and its measured error is
///     smaller by a third. The usual set `1`, `2`, `1/2`, `4` amplifies errors 4 times as much.
#[derive(Debug, Clone)]
pub(super) struct Points {
    pub(super) n_pairs: usize,
    /// The positive interpolation points.
    pub(super) positive: [f32; MAX_PAIRS],
    /// Coefficients of `w`, lowest power first; the coefficient of the highest power is 1.
    pub(super) whole: [f32; MAX_PAIRS],
    /// Coefficients of `v_p`, in the order of `whole`.
    pub(super) without: [[f32; MAX_PAIRS]; MAX_PAIRS],
    /// `powers[i][k] = positive[k]^i`.
    pub(super) powers: [[f32; MAX_PAIRS]; MAX_TILE],
}

impl Points {
    /// Points for tiles of 8 (3 pairs) or 10 (4 pairs).
    pub(super) fn new(n_pairs: usize) -> Self {
        let points: &[f32] = match n_pairs {
            3 => &[1.0, 2.0, 0.5],
            _ => &[1.0, 2.5, 1.25, 0.3125],
        };
        let mut all = Self {
            n_pairs,
            positive: [0.0; MAX_PAIRS],
            whole: [0.0; MAX_PAIRS],
            without: [[0.0; MAX_PAIRS]; MAX_PAIRS],
            powers: [[0.0; MAX_PAIRS]; MAX_TILE],
        };
        all.positive[..n_pairs].copy_from_slice(points);
        all.whole = product(points.iter().copied());
        for k in 0..n_pairs {
            let others = points.iter().enumerate().filter(|(i, _)| *i != k);
            all.without[k] = product(others.map(|(_, point)| *point));
            for (i, powers) in all.powers.iter_mut().enumerate() {
                powers[k] = power(f64::from(points[k]), i) as f32;
            }
        }
        all
    }

    /// Number of values in a line of a tile.
    pub(super) fn tile(&self) -> usize {
        2 * self.n_pairs + 2
    }

    /// The finite interpolation points, in the order of the transformed values.
    fn finite(&self) -> Vec<f64> {
        let pairs = self.positive[..self.n_pairs].iter().map(|&positive| f64::from(positive));
        std::iter::once(0.0).chain(pairs.flat_map(|pair| [pair, -pair])).collect()
    }

    /// `G`, `tile x taps`: the matrix for a line of a filter.
    pub(super) fn of_filter(&self, taps: usize) -> Vec<Vec<f64>> {
        let points = self.finite();
        let row = |p: &f64| {
            let others = points.iter().filter(|point| *point != p);
            let divisor: f64 = others.map(|other| p - other).product();
            (0..taps).map(|i| power(*p, i) / divisor).collect()
        };
        let last = (0..taps).map(|i| f64::from(i + 1 == taps)).collect();
        points.iter().map(row).chain([last]).collect()
    }

    /// `B^T`, `tile x tile`: the matrix for a line of cells.
    fn of_cells(&self) -> Vec<Vec<f64>> {
        let n = self.tile();
        let mut rows = vec![vec![0.0; n]; n];
        let highest = |coefficients: &[f32], degree: usize| {
            let low = coefficients[..degree].iter().map(|&coefficient| f64::from(coefficient));
            low.chain([1.0]).collect::<Vec<_>>()
        };
        for (j, value) in highest(&self.whole, self.n_pairs).into_iter().enumerate() {
            rows[0][2 * j] = value;
            rows[n - 1][2 * j + 1] = value;
        }
        for k in 0..self.n_pairs {
            let without = highest(&self.without[k], self.n_pairs - 1);
            for (j, value) in without.into_iter().enumerate() {
                for (row, sign) in [(1 + 2 * k, 1.0), (2 + 2 * k, -1.0)] {
                    rows[row][2 * j + 2] = value;
                    rows[row][2 * j + 1] = sign * f64::from(self.positive[k]) * value;
                }
            }
        }
        rows
    }

    /// `A^T`, `placements x tile`: the matrix for a line of products.
    fn of_products(&self, placements: usize) -> Vec<Vec<f64>> {
        let row = |i: usize| {
            let finite = self.finite().into_iter().map(|p| power(p, i));
            finite.chain([f64::from(i + 1 == placements)]).collect()
        };
        (0..placements).map(row).collect()
    }

    /// Upper bound of the ratio between the absolute terms of the sums in a tile and those of the direct sum. It is the largest `sum over
    /// a, j of |A_ij| |G_jc| |B_ja|` over placements `i` and taps `c`.
    pub(super) fn amplification(&self, taps: usize) -> f64 {
        let (a, b) = (self.of_products(self.tile() + 1 - taps), self.of_cells());
        let g = self.of_filter(taps);
        let sums: Vec<f64> = b.iter().map(|row| row.iter().map(|row| row.abs()).sum()).collect();
        let of = |row: &Vec<f64>, c: usize| -> f64 {
            let terms = row.iter().zip(&g).zip(&sums);
            terms.map(|((a, g), sum)| (a * g[c]).abs() * sum).sum()
        };
        let all = a.iter().flat_map(|row| (0..taps).map(move |c| of(row, c)));
        all.fold(0.0, f64::max)
    }

    /// Maximum number of roundings between a cell or weight and a response, without the additions
    /// over channels: both lines of cells, the transformed weight, both lines of products.
    pub(super) fn roundings(&self) -> usize {
        2 * self.n_pairs + 1 + 2 * (self.n_pairs + 1)
    }
}

/// Computes `p^n`. The function of the standard library may round intermediate results, and differently on another machine.
fn power(p: f64, n: usize) -> f64 {
    std::iter::repeat_n(p, n).product()
}

/// Coefficients of the product of `z - p^2`, lowest first.
fn product(points: impl Iterator<Item = f32>) -> [f32; MAX_PAIRS] {
    let mut all = [0.0; MAX_PAIRS + 1];
    all[0] = 1.0;
    for p in points {
        for it in (0..=MAX_PAIRS).rev() {
            let lower = if it == 0 { 0.0 } else { all[it - 1] };
            all[it] = lower - p * p * all[it];
        }
    }
    [all[0], all[1], all[2], all[3]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sized;

    /// Tests that interpolation is exact: placement `i` combines filter cell `c` with map cell `i + c` only.
    #[test]
    fn the_transform_matrices_compute_a_correlation() {
        for n_pairs in [3, 4] {
            let points = Points::new(n_pairs);
            for taps in 3..=sized(6, 4) {
                let placements = points.tile() + 1 - taps;
                let (a, b) = (points.of_products(placements), points.of_cells());
                let g = points.of_filter(taps);
                for (i, c, cell) in indices(placements, taps, points.tile()) {
                    let terms = (0..points.tile()).map(|j| a[i][j] * g[j][c] * b[j][cell]);
                    let want = f64::from(i + c == cell);
                    assert!((terms.sum::<f64>() - want).abs() < 1e-12);
                }
            }
        }
    }

    fn indices(a: usize, b: usize, c: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        (0..a * b * c).map(move |i| (i / (b * c), i / c % b, i % c))
    }

    /// Tests that these numbers are exact, because the error bound does not include their rounding.
    #[test]
    fn all_constants_are_exact_in_single_precision() {
        for n_pairs in [3, 4] {
            let points = Points::new(n_pairs);
            let exact: Vec<f64> =
                points.positive[..n_pairs].iter().map(|&p| f64::from(p)).collect();
            for (k, p) in exact.iter().enumerate() {
                for (i, powers) in points.powers.iter().enumerate() {
                    assert_eq!(f64::from(powers[k]), power(*p, i));
                }
                let at = |z: f64, coefficients: &[f32]| {
                    let terms = coefficients.iter().enumerate();
                    terms.map(|(i, &c)| f64::from(c) * power(z, i)).sum::<f64>()
                };
                let whole = at(p * p, &points.whole[..n_pairs]) + power(*p, 2 * n_pairs);
                assert_eq!(whole, 0.0);
                for other in exact.iter().filter(|exact| *exact != p) {
                    let rest = at(other * other, &points.without[k][..n_pairs - 1]);
                    assert_eq!(rest + power(*other, 2 * n_pairs - 2), 0.0);
                }
            }
        }
    }

    #[test]
    fn larger_tiles_amplify_more() {
        let of = |n_pairs| Points::new(n_pairs).amplification(5);
        assert!((of(3) - 39.6).abs() < 0.1, "{}", of(3));
        assert!((of(4) - 179.7).abs() < 0.1, "{}", of(4));
    }
}
