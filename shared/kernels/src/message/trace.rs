//! Finds the child from which a message entry came: the arguments of the maxima, for one cell.

use super::{ChildScores, Grid, MessageRule};
use crate::spring::Spring;

/// The child from which a message entry came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracedChild {
    /// Value of the entry.
    pub score: f32,
    /// Type of the child.
    pub child_type: usize,
    /// Row of the child.
    pub y: usize,
    /// Column of the child.
    pub x: usize,
}

impl MessageRule {
    /// Returns the child from which the message entry at one cell of the parent came. This evaluates the same expressions as
    /// [`add_message`](Self::add_message), so `score` is the added value, bit for bit. Ties go to the first choice, then to the first
    /// column, then to the first row, as in the reference programs. Returns `None` if every child is impossible.
    ///
    /// * `child`: as for [`add_message`](Self::add_message).
    /// * `at`: `[row, column]` of the parent.
    ///
    /// # Panics
    ///
    /// Panics if the lengths do not match, or `parent_type` or `at` is out of range.
    pub fn trace(
        &self,
        child: ChildScores<'_>,
        parent_type: usize,
        at: [usize; 2],
    ) -> Option<TracedChild> {
        self.check(child);
        let grid = child.grid;
        assert!(at[0] < grid.rows && at[1] < grid.cols, "a cell of the grid");
        let mut best: Option<TracedChild> = None;
        for &(spring, bias) in &self.choices[parent_type] {
            let (child_type, spring) = &self.springs[spring];
            let plane = (child.planes, *child_type);
            let Some((score, [y, x])) =
                best_child(grid, plane, spring, child.ranges[*child_type].spread(), at)
            else {
                continue;
            };
            let score = score + bias;
            if best.map_or(score > f32::NEG_INFINITY, |best| score > best.score) {
                best = Some(TracedChild {
                    score,
                    child_type: *child_type,
                    y,
                    x,
                });
            }
        }
        best
    }

    /// The value of a message entry for a given child, or minus infinity if the pair of types is
    /// not allowed.
    ///
    /// The expression is the same as in [`add_message`](Self::add_message): `((score + vertical) +
    /// horizontal) + bias`.
    ///
    /// * `child_score`: score of the child at `child`, `[row, column]`.
    /// * `types`: types of the parent and of the child.
    pub fn value(
        &self,
        child_score: f32,
        types: [usize; 2],
        parent: [usize; 2],
        child: [usize; 2],
    ) -> f32 {
        let [down, along] = [0, 1].map(|axis| child[axis] as isize - parent[axis] as isize);
        let choice = |&(spring, bias): &(usize, f32)| {
            let (child_type, spring) = &self.springs[spring];
            let value = child_score + spring.y().score(down) + spring.x().score(along) + bias;
            (*child_type == types[1]).then_some(value)
        };
        let values = self.choices[types[0]].iter().filter_map(choice);
        values.fold(f32::NEG_INFINITY, f32::max)
    }
}

/// The best child of one plane for a parent at `at`, and its `[row, column]`.
fn best_child(
    grid: Grid,
    (planes, plane): (&[f32], usize),
    spring: &Spring,
    spread: f32,
    at: [usize; 2],
) -> Option<(f32, [usize; 2])> {
    let rows = spring.y().reach(grid.rows, spread).window(at[0]);
    let cols = spring.x().reach(grid.cols, spread).window(at[1]);
    let mut best = None;
    let mut max = f32::NEG_INFINITY;
    for x in cols {
        let (mut column, mut row) = (f32::NEG_INFINITY, 0);
        for y in rows.clone() {
            let score =
                planes[grid.at(plane, y, x)] + spring.y().score(y as isize - at[0] as isize);
            if score > column {
                (column, row) = (score, y);
            }
        }
        let score = column + spring.x().score(x as isize - at[1] as isize);
        if score > max {
            max = score;
            best = Some((score, [row, x]));
        }
    }
    best
}
