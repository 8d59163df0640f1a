//! One generalised distance transform on one grid: its candidates and the scores of the spring.

use std::ops::Range;

use super::{BLOCK, Grid, ROW_ALIGN};
use crate::spring::{Axis, Spring};

/// The precomputed data of a transform.
#[derive(Debug, Default, Clone)]
pub(super) struct Transform {
    /// Index of the child's plane.
    pub(super) plane: usize,
    /// True if the whole plane is minus infinity.
    pub(super) impossible: bool,
    /// The vertical pass, by blocks of [`BLOCK`] rows.
    pub(super) down: Pass,
    /// The horizontal pass, by runs of [`ROW_ALIGN`] cells.
    pub(super) along: Pass,
}

/// One pass of a transform.
#[derive(Debug, Default, Clone)]
pub(super) struct Pass {
    /// Range of offsets that every block of parents tries.
    blocks: Vec<Range<isize>>,
    /// Scores that the spring adds, starting at the first offset of any block.
    scores: Vec<f32>,
    first: isize,
}

impl Pass {
    #[inline(always)]
    fn prepare(&mut self, axis: Axis, n: usize, block: usize, spread: f32) {
        let reach = axis.reach(n, spread);
        self.blocks.clear();
        let blocks = (0..n).step_by(block);
        let offsets = blocks.map(|first| reach.offsets(first..n.min(first + block)));
        self.blocks.extend(offsets);
        let all = self.blocks.iter().cloned();
        let all = all.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        let all = all.unwrap_or(0..0);
        self.first = all.start;
        self.scores.clear();
        self.scores.extend(all.map(|offset| axis.score(offset)));
    }

    /// Number of candidates that all parents of a line try.
    pub(super) fn n_candidates(&self, n: usize, block: usize) -> usize {
        let parents = (0..n).step_by(block).map(|first| block.min(n - first));
        let offsets = self.blocks.iter().map(|block| (block.end - block.start) as usize);
        parents.zip(offsets).map(|(parents, offsets)| parents * offsets).sum()
    }

    /// The first offset that a block tries, and the scores that the spring adds at this and the following offsets.
    #[inline(always)]
    pub(super) fn of_block(&self, block: usize) -> (isize, &[f32]) {
        let offsets = &self.blocks[block];
        let start = (offsets.start - self.first) as usize;
        let n = (offsets.end - offsets.start) as usize;
        (offsets.start, &self.scores[start..][..n])
    }
}

impl Transform {
    #[inline(always)]
    pub(super) fn prepare(&mut self, grid: Grid, plane: usize, spring: &Spring, spread: f32) {
        self.plane = plane;
        self.impossible = spread.is_nan();
        self.down.prepare(spring.y(), grid.rows, BLOCK, spread);
        self.along.prepare(spring.x(), grid.cols, ROW_ALIGN, spread);
    }
}
