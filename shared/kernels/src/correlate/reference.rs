//! The definition in double precision, and readable versions of both fast methods with the same bits.

use super::Template;
#[cfg(test)]
use super::{FORMS, Level, Method, winograd::Form};
use crate::N_CHANNELS;

/// The response map of one filter in double precision.
///
/// * `cells`: `map_size[0] x map_size[1] x N_CHANNELS`, channel fastest, then column.
/// * Returns `size[0] x size[1]` responses; each is
///   stored at the position of the filter's top-left cell.
///
/// # Panics
///
/// Panics if a placement is not on the map.
pub fn correlate_f64(
    filter: Template<'_>,
    map_size: [usize; 2],
    cells: &[f64],
    size: [usize; 2],
) -> Vec<f64> {
    let run = filter.cols * N_CHANNELS;
    let response = |y: usize, x: usize| {
        let row = |r: usize| {
            let cells = &cells[((y + r) * map_size[1] + x) * N_CHANNELS..][..run];
            let weights = &filter.weights[r * run..][..run];
            cells.iter().zip(weights).map(|(a, b)| a * b).sum::<f64>()
        };
        (0..filter.rows).map(row).sum()
    };
    (0..size[0] * size[1]).map(|at| response(at / size[1], at % size[1])).collect()
}

/// The response map of one filter, computed by the given method.
#[cfg(test)]
pub(super) fn correlate(way: Method, filter: Template<'_>, level: Level<'_>) -> Vec<f32> {
    match way {
        Method::Direct => direct(filter, level),
        Method::Tiles(it) => tiled(
            &Form::new(FORMS[it], [filter.rows, filter.cols]),
            filter,
            level,
        ),
    }
}

#[cfg(test)]
fn direct(filter: Template<'_>, Level { map, size }: Level<'_>) -> Vec<f32> {
    let run = filter.cols * N_CHANNELS;
    let response = |y: usize, x: usize| {
        let mut sum = 0.0_f32;
        for r in 0..filter.rows {
            let cells = &map.cells[((y + r) * map.cols + x) * N_CHANNELS..][..run];
            for (cell, weight) in cells.iter().zip(&filter.weights[r * run..]) {
                sum = cell.mul_add(*weight as f32, sum);
            }
        }
        sum
    };
    (0..size[0] * size[1]).map(|at| response(at / size[1], at % size[1])).collect()
}

/// Computes `A^T ((sum over channels of (B^T d B) . (G w G^T))) A` on every tile.
#[cfg(test)]
fn tiled(form: &Form, filter: Template<'_>, Level { map, size }: Level<'_>) -> Vec<f32> {
    let n = form.points.tile();
    let [rows, cols] = form.placements;
    let weights = form.of_filter([filter.rows, filter.cols], filter.weights);
    let mut out = vec![f32::NAN; size[0] * size[1]];
    for y in (0..size[0]).step_by(rows) {
        for x in (0..size[1]).step_by(cols) {
            let mut products = vec![vec![0.0_f32; n]; n];
            for k in 0..N_CHANNELS {
                let cell = |r: usize, c: usize| {
                    let inside = y + r < map.rows && x + c < map.cols;
                    let at = ((y + r) * map.cols + x + c) * N_CHANNELS + k;
                    if inside { map.cells[at] } else { 0.0 }
                };
                let columns = (0..n).map(|c| (0..n).map(|r| cell(r, c)).collect());
                let columns: Vec<_> =
                    columns.map(|column: Vec<f32>| of_cells(form, &column)).collect();
                for a in 0..n {
                    let row: Vec<_> = columns.iter().map(|column| column[a]).collect();
                    for (b, value) in of_cells(form, &row).into_iter().enumerate() {
                        let weight = weights[(a * n + b) * N_CHANNELS + k] as f32;
                        products[a][b] = value.mul_add(weight, products[a][b]);
                    }
                }
            }
            let columns = (0..n).map(|b| products.iter().map(|product| product[b]).collect());
            let columns: Vec<_> =
                columns.map(|column: Vec<f32>| of_products(form, &column, rows)).collect();
            for i in 0..rows.min(size[0] - y) {
                let row: Vec<_> = columns.iter().map(|column| column[i]).collect();
                let row = of_products(form, &row, cols);
                let width = cols.min(size[1] - x);
                out[(y + i) * size[1] + x..][..width].copy_from_slice(&row[..width]);
            }
        }
    }
    out
}

/// Multiplies a line by `B^T`, computing even and odd values separately.
#[cfg(test)]
fn of_cells(form: &Form, line: &[f32]) -> Vec<f32> {
    let points = &form.points;
    let polynomial = |coefficients: &[f32], first: usize| {
        let values = line[first..].iter().step_by(2);
        let mut low: Vec<_> = coefficients.iter().zip(values.clone()).collect();
        let mut sum = *values.clone().nth(low.len()).expect("a value for the highest power");
        while let Some((c, value)) = low.pop() {
            sum = c.mul_add(*value, sum);
        }
        sum
    };
    let whole = &points.whole[..points.n_pairs];
    let mut out = vec![polynomial(whole, 0)];
    for k in 0..points.n_pairs {
        let without = &points.without[k][..points.n_pairs - 1];
        let (even, odd) = (polynomial(without, 2), polynomial(without, 1));
        out.push(points.positive[k].mul_add(odd, even));
        out.push((-points.positive[k]).mul_add(odd, even));
    }
    out.push(polynomial(whole, 1));
    out
}

/// Multiplies a line by `A^T`, computing each point together with its negative.
#[cfg(test)]
fn of_products(form: &Form, line: &[f32], placements: usize) -> Vec<f32> {
    let points = &form.points;
    let (pairs, _) = line[1..=2 * points.n_pairs].as_chunks::<2>();
    let power = |i: usize| {
        let sign = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let term = |(k, pair): (usize, &[f32; 2])| (points.powers[i][k], pair[0] + sign * pair[1]);
        let terms = pairs.iter().enumerate().map(term);
        let zero = if i == 0 { line[0] } else { -0.0 };
        terms.fold(zero, |sum, (power, term)| power.mul_add(term, sum))
    };
    let mut out: Vec<_> = (0..placements).map(power).collect();
    out[placements - 1] += line[line.len() - 1];
    out
}
