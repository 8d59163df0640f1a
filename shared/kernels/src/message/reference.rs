//! The definition, which evaluates every candidate, one after the other.

use super::{Grid, MessageRule};
use crate::spring::Spring;

/// Works like [`MessageRule::add_message`].
pub(super) fn add_message(rule: &MessageRule, grid: Grid, child: &[f32], parent: &mut [f32]) {
    let transformed: Vec<_> = rule
        .springs
        .iter()
        .map(|(child_type, spring)| transform(grid, (child, *child_type), spring))
        .collect();
    for (l, choices) in rule.choices.iter().enumerate() {
        for y in 0..grid.rows {
            for x in 0..grid.cols {
                let value = choices.iter().fold(f32::NEG_INFINITY, |best, &(spring, bias)| {
                    best.max(transformed[spring][y * grid.cols + x] + bias)
                });
                parent[grid.at(l, y, x)] += value;
            }
        }
    }
}

/// The distance transform of one plane, `rows x cols`: down the columns, then along the rows.
fn transform(grid: Grid, (planes, plane): (&[f32], usize), spring: &Spring) -> Vec<f32> {
    let mut middle = vec![f32::NEG_INFINITY; grid.rows * grid.cols];
    let mut out = middle.clone();
    for x in 0..grid.cols {
        for p in 0..grid.rows {
            let best = &mut middle[p * grid.cols + x];
            for v in 0..grid.rows {
                let score =
                    planes[grid.at(plane, v, x)] + spring.y().score(v as isize - p as isize);
                *best = score.max(*best);
            }
        }
    }
    for y in 0..grid.rows {
        for p in 0..grid.cols {
            let best = &mut out[y * grid.cols + p];
            for v in 0..grid.cols {
                let score = middle[y * grid.cols + v] + spring.x().score(v as isize - p as isize);
                *best = score.max(*best);
            }
        }
    }
    out
}
