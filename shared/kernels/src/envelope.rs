//! The distance transform in double precision, along the lower envelope of parabolas.
//!
//! The method is that of Felzenszwalb & Huttenlocher, *Distance Transforms of Sampled Functions*, 2012, as in the reference programs. All
//! values are in double precision, except the breakpoints of the envelope, which are rounded to single precision.

use crate::spring::{Axis, Spring};

/// The best child for every position of the parent in a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Transformed {
    /// `max over v: plane[v] + spring(p, v)`, `rows x cols`.
    pub score: Vec<f64>,
    /// Column of the child with this score.
    pub x: Vec<usize>,
    /// Row of the child with this score.
    pub y: Vec<usize>,
}

/// Transforms a plane of `rows x cols` finite scores: down the columns, then along the rows.
///
/// # Panics
///
/// Panics if the plane is not `rows x cols`.
pub fn transform_f64(plane: &[f64], [rows, cols]: [usize; 2], spring: &Spring) -> Transformed {
    assert_eq!(plane.len(), rows * cols, "one score per cell");
    let mut down = vec![(0.0, 0); rows * cols];
    for x in 0..cols {
        let column: Vec<_> = (0..rows).map(|y| plane[y * cols + x]).collect();
        for (y, found) in line(&column, spring.y()).into_iter().enumerate() {
            down[y * cols + x] = found;
        }
    }
    let mut out = Transformed {
        score: Vec::with_capacity(plane.len()),
        x: Vec::with_capacity(plane.len()),
        y: Vec::with_capacity(plane.len()),
    };
    for row in down.chunks_exact(cols.max(1)) {
        let scores: Vec<_> = row.iter().map(|row| row.0).collect();
        for (score, x) in line(&scores, spring.x()) {
            out.score.push(score);
            out.x.push(x);
            out.y.push(row[x].1);
        }
    }
    out
}

/// For every position of the parent on a line, the score and the position of the best child.
fn line(scores: &[f64], axis: Axis) -> Vec<(f64, usize)> {
    // Parabolas of the envelope from left to right, with the position from which each is the highest.
    let mut leaders: Vec<(usize, f32)> = Vec::with_capacity(scores.len());
    for q in 0..scores.len() {
        let mut begin = f32::NEG_INFINITY;
        while let Some(&(v, led_from)) = leaders.last() {
            begin = crossing(scores, axis, v, q);
            if begin > led_from {
                break;
            }
            leaders.pop();
        }
        if leaders.is_empty() {
            begin = f32::NEG_INFINITY;
        }
        leaders.push((q, begin));
    }
    let mut at = 0;
    let best = |p: usize| {
        let probe = p as f64 + f64::from(axis.anchor);
        while at + 1 < leaders.len() && f64::from(leaders[at + 1].1) < probe {
            at += 1;
        }
        let v = leaders[at].0;
        let d = probe - v as f64;
        (scores[v] - axis.quadratic * d * d - axis.linear * d, v)
    };
    (0..scores.len()).map(best).collect()
}

/// Position where the parabola of `q` overtakes that of `v < q`, rounded to single precision.
fn crossing(scores: &[f64], axis: Axis, v: usize, q: usize) -> f32 {
    let (from, to) = (v as f64, q as f64);
    let gain = (scores[q] - scores[v]) + axis.linear * (to - from)
        - axis.quadratic * (to * to - from * from);
    (gain / (-2.0 * axis.quadratic * (to - from))) as f32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn equals_the_exhaustive_search(
            (rows, cols) in (1..12_usize, 1..12_usize),
            values in prop::collection::vec(-8..8_i8, 144),
            w in (0.01..0.3, -0.2..0.2, 0.01..0.3, -0.2..0.2),
            anchor in [-5..6_i32, -5..6_i32],
        ) {
            let plane: Vec<_> = values[..rows * cols].iter().map(|&value| f64::from(value) * 0.1).collect();
            let spring = Spring { w: w.into(), anchor };
            let got = transform_f64(&plane, [rows, cols], &spring);
            for p in 0..rows * cols {
                let score = |v: usize| {
                    let dx = (p % cols) as f64 + f64::from(anchor[0]) - (v % cols) as f64;
                    let dy = (p / cols) as f64 + f64::from(anchor[1]) - (v / cols) as f64;
                    plane[v] - w.0 * dx * dx - w.1 * dx - w.2 * dy * dy - w.3 * dy
                };
                let best = (0..rows * cols).map(score).fold(f64::NEG_INFINITY, f64::max);
                prop_assert!((best - got.score[p]).abs() < 1e-5);
                prop_assert!((score(got.y[p] * cols + got.x[p]) - got.score[p]).abs() < 1e-12);
            }
        }
    }
}
