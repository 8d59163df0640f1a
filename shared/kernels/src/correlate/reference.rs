//! The definition, once in the precision that ships and once in double.

use super::{FeatureMap, PANEL, Panel, Template};
use crate::N_CHANNELS;

pub(super) fn correlate(
    panel: &Panel,
    map: FeatureMap<'_>,
    [rows, cols]: [usize; 2],
    out: &mut [f32],
) {
    let run = panel.cols * N_CHANNELS;
    for lane in 0..panel.filters.len() {
        for y in 0..rows {
            for x in 0..cols {
                let mut sum = 0.0_f32;
                for r in 0..panel.rows {
                    let cells = &map.cells[((y + r) * map.cols + x) * N_CHANNELS..][..run];
                    let weights = panel.weights[r * run * PANEL + lane..]
                        .iter()
                        .step_by(PANEL);
                    for (cell, weight) in cells.iter().zip(weights) {
                        sum = cell.mul_add(*weight, sum);
                    }
                }
                out[(lane * rows + y) * cols + x] = sum;
            }
        }
    }
}

/// The response map of one filter in double precision.
///
/// * `cells`: `map_size[0] x map_size[1] x N_CHANNELS`, channel fastest, then column.
/// * Returns `size[0] x size[1]` responses; the filter's top left cell is the response's cell.
///
/// # Panics
///
/// If a placement does not lie on the map.
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
    (0..size[0] * size[1])
        .map(|at| response(at / size[1], at % size[1]))
        .collect()
}
