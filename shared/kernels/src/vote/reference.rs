//! The definition: every candidate, one after the other.

use super::{Grid, VoteRule};
use crate::spring::Spring;

/// As [`VoteRule::cast`].
pub(super) fn cast(rule: &VoteRule, grid: Grid, child: &[f32], parent: &mut [f32]) {
    let transformed: Vec<_> = rule
        .springs
        .iter()
        .map(|(child_type, spring)| {
            transform(
                grid,
                &child[child_type * grid.plane()..][..grid.plane()],
                spring,
            )
        })
        .collect();
    for (l, choices) in rule.choices.iter().enumerate() {
        for y in 0..grid.rows {
            for x in 0..grid.cols {
                let vote = choices
                    .iter()
                    .fold(f32::NEG_INFINITY, |best, &(spring, bias)| {
                        best.max(transformed[spring][grid.at(y, x)] + bias)
                    });
                parent[l * grid.plane() + grid.at(y, x)] += vote;
            }
        }
    }
}

/// The distance transform of one plane: down the columns, then along the rows.
fn transform(grid: Grid, plane: &[f32], spring: &Spring) -> Vec<f32> {
    let mut middle = vec![f32::NEG_INFINITY; grid.plane()];
    let mut out = middle.clone();
    for x in 0..grid.cols {
        for p in 0..grid.rows {
            for v in 0..grid.rows {
                let score = plane[grid.at(v, x)] + spring.y().score(v as isize - p as isize);
                middle[grid.at(p, x)] = score.max(middle[grid.at(p, x)]);
            }
        }
    }
    for y in 0..grid.rows {
        for p in 0..grid.cols {
            for v in 0..grid.cols {
                let score = middle[grid.at(y, v)] + spring.x().score(v as isize - p as isize);
                out[grid.at(y, p)] = score.max(out[grid.at(y, p)]);
            }
        }
    }
    out
}
