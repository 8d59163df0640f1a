//! Each lane of a register is a cell of the parent, and evaluates the candidates of this cell in the order of their offsets.

use std::hint::black_box;

use super::buffer::ScoreBuffer;
use super::range::{RunningRange, ScoreRange};
use super::transform::Transform;
use super::{BLOCK, ChildScores, Grid, MessageRule, ROW_ALIGN};
use crate::simd::{Kernel, Simd};

/// Buffers of [`MessageRule::add_message`], reused from call to call.
#[derive(Debug, Default)]
pub struct MessageWorkspace {
    transforms: Vec<Transform>,
    /// A block of rows after the vertical pass, with space for candidates outside the grid.
    middle: ScoreBuffer,
    /// A block of rows of every transform.
    transformed: ScoreBuffer,
    /// Range of every plane of the parent.
    running: Vec<RunningRange>,
}

/// The kernel of [`MessageRule::add_message`].
pub(super) struct AddMessage<'a> {
    pub(super) rule: &'a MessageRule,
    pub(super) child: ChildScores<'a>,
    /// The parent's planes and their score ranges.
    pub(super) parent: (&'a mut [f32], &'a mut [ScoreRange]),
    pub(super) workspace: &'a mut MessageWorkspace,
}

impl Kernel for AddMessage<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self {
            rule,
            child,
            parent: (parent, ranges),
            workspace,
        } = self;
        let grid = child.grid;
        workspace.prepare(rule, child);
        for first in (0..grid.rows).step_by(BLOCK) {
            let work = Block {
                rule,
                child,
                first,
                n: BLOCK.min(grid.rows - first),
            };
            if work.n > BLOCK / 2 {
                work.add_message::<S, BLOCK>(simd, parent, workspace);
            } else {
                work.add_message::<S, { BLOCK / 2 }>(simd, parent, workspace);
            }
        }
        for (range, running) in ranges.iter_mut().zip(&workspace.running) {
            *range = running.range();
        }
    }
}

impl MessageWorkspace {
    /// Number of candidates that the last [`MessageRule::add_message`] on a grid of this size evaluated.
    pub fn n_candidates(&self, rule: &MessageRule, grid: Grid) -> usize {
        let transforms = self.transforms.iter().take(rule.springs.len());
        let of_spring = transforms.map(|transform| {
            let down = transform.down.n_candidates(grid.rows, BLOCK) * grid.cols;
            down + transform.along.n_candidates(grid.cols, ROW_ALIGN) * grid.rows
        });
        of_spring.sum()
    }

    #[inline(always)]
    fn prepare(&mut self, rule: &MessageRule, child: ChildScores<'_>) {
        let grid = child.grid;
        let n_springs = rule.springs.len();
        if self.transforms.len() < n_springs {
            self.transforms.resize_with(n_springs, Transform::default);
        }
        self.transformed.resize(n_springs * BLOCK * grid.stride());
        let blocks = self.transformed.scores_mut();
        let blocks = blocks.chunks_exact_mut(BLOCK * grid.stride());
        let transforms = self.transforms.iter_mut().zip(blocks);
        for ((transform, block), (plane, spring)) in transforms.zip(&rule.springs) {
            transform.prepare(grid, *plane, spring, child.ranges[*plane].spread());
            if transform.impossible {
                block.fill(f32::NEG_INFINITY);
            }
        }
        self.middle.resize(BLOCK * middle_stride(grid));
        self.middle.scores_mut().fill(f32::NEG_INFINITY);
        self.running.clear();
        self.running.resize(rule.choices.len(), RunningRange::NONE);
    }
}

/// Length of a row between the passes. A run of cells tries all offsets at which any of its cells has a candidate. Other cells of the run
/// therefore read beyond the ends of the row, by at most the length of a run.
fn middle_stride(grid: Grid) -> usize {
    grid.stride() + 2 * ROW_ALIGN
}

/// Rows of the parent that all try the same offsets.
#[derive(Clone, Copy)]
struct Block<'a> {
    rule: &'a MessageRule,
    child: ChildScores<'a>,
    first: usize,
    /// Number of rows.
    n: usize,
}

impl Block<'_> {
    /// Computes the message for the block of `R` rows, of which the last rows may not exist.
    #[inline(always)]
    fn add_message<S: Simd, const R: usize>(
        &self,
        simd: S,
        parent: &mut [f32],
        workspace: &mut MessageWorkspace,
    ) {
        let grid = self.child.grid;
        let MessageWorkspace {
            transforms,
            middle,
            transformed,
            running,
        } = workspace;
        let size = BLOCK * grid.stride();
        let blocks = transformed.scores_mut().chunks_exact_mut(size);
        for (transform, out) in transforms.iter().zip(blocks) {
            if !transform.impossible {
                self.transform_down::<S, R>(simd, transform, middle.scores_mut());
                self.transform_along::<S, R>(simd, transform, middle.scores(), out);
            }
        }
        let transformed = transformed.scores();
        for (l, (choices, running)) in self.rule.choices.iter().zip(running).enumerate() {
            let rows = &mut parent[grid.at(l, self.first, 0)..][..self.n * grid.stride()];
            self.add_best::<S, R>(simd, choices, transformed, (rows, running));
        }
    }

    #[inline(always)]
    fn transform_down<S: Simd, const R: usize>(
        &self,
        simd: S,
        transform: &Transform,
        middle: &mut [f32],
    ) {
        let grid = self.child.grid;
        let stride = grid.stride();
        let (offset, scores) = transform.down.of_block(self.first / BLOCK);
        let top = grid.at(transform.plane, self.first, 0);
        let top = top.wrapping_add_signed(offset * stride as isize);
        let lines = &self.child.planes[top..][..(scores.len() + R - 1) * stride];
        assert!(
            grid.cols.next_multiple_of(S::LANES) <= stride,
            "rows are padded"
        );
        let load = |row: usize, x: usize| {
            debug_assert!(row + 1 < scores.len() + R && x < grid.cols, "a candidate");
            // SAFETY: the row is one of `lines`, and a register that begins left of the grid's last
            // column ends within the row.
            unsafe { simd.load_at(lines, row * stride + x) }
        };
        let one = simd.splat(black_box(1.0));
        let (pairs, single) = scores.as_chunks::<2>();
        for x in (0..grid.cols).step_by(S::LANES) {
            let mut best = [simd.splat(f32::NEG_INFINITY); R];
            for (step, [score, next]) in pairs.iter().enumerate() {
                let (score, next) = (simd.splat(*score), simd.splat(*next));
                // A row contains the candidates of one parent at this offset, and of the previous parent
                // at the next offset.
                let mut candidates = load(2 * step, x);
                for (r, best) in best.iter_mut().enumerate() {
                    *best = simd.max(simd.plus(candidates, one, score), *best);
                    candidates = load(2 * step + r + 1, x);
                    *best = simd.max(simd.plus(candidates, one, next), *best);
                }
            }
            for score in single {
                let score = simd.splat(*score);
                for (r, best) in best.iter_mut().enumerate() {
                    let candidates = load(2 * pairs.len() + r, x);
                    *best = simd.max(simd.plus(candidates, one, score), *best);
                }
            }
            for (r, best) in best.into_iter().enumerate() {
                simd.store(best, &mut middle[r * middle_stride(grid) + ROW_ALIGN + x..]);
            }
        }
    }

    #[inline(always)]
    fn transform_along<S: Simd, const R: usize>(
        &self,
        simd: S,
        transform: &Transform,
        middle: &[f32],
        out: &mut [f32],
    ) {
        let grid = self.child.grid;
        let one = simd.splat(black_box(1.0));
        let stride = middle_stride(grid);
        assert!(middle.len() >= R * stride, "R rows");
        for x in (0..grid.cols).step_by(S::LANES) {
            let (offset, scores) = transform.along.of_block(x / ROW_ALIGN);
            let first = (ROW_ALIGN + x).wrapping_add_signed(offset);
            assert!(
                first + scores.len() + S::LANES <= stride + 1,
                "offsets must end beside the grid"
            );
            let mut best = [simd.splat(f32::NEG_INFINITY); R];
            for (at, score) in scores.iter().enumerate() {
                let score = simd.splat(*score);
                for (r, best) in best.iter_mut().enumerate() {
                    // SAFETY: `middle` has R rows, and the assertion above keeps `at` inside one of them.
                    let candidates = unsafe { simd.load_at(middle, r * stride + first + at) };
                    *best = simd.max(simd.plus(candidates, one, score), *best);
                }
            }
            for (r, best) in best.into_iter().enumerate() {
                simd.store(best, &mut out[r * grid.stride() + x..]);
            }
        }
    }

    #[inline(always)]
    fn add_best<S: Simd, const R: usize>(
        &self,
        simd: S,
        choices: &[(usize, f32)],
        transformed: &[f32],
        (rows, running): (&mut [f32], &mut RunningRange),
    ) {
        let grid = self.child.grid;
        let stride = grid.stride();
        let one = simd.splat(black_box(1.0));
        let mut seen = running.load(simd);
        for x in (0..grid.cols).step_by(S::LANES) {
            let mut best = [simd.splat(f32::NEG_INFINITY); R];
            for &(spring, bias) in choices {
                let bias = simd.splat(bias);
                let block = &transformed[spring * BLOCK * stride..][..BLOCK * stride];
                for (r, best) in best.iter_mut().enumerate() {
                    let scores = simd.load(&block[r * stride + x..]);
                    *best = simd.max(simd.plus(scores, one, bias), *best);
                }
            }
            for (best, row) in best.into_iter().zip(rows.chunks_exact_mut(stride)) {
                let row = &mut row[x..];
                let sum = simd.plus(simd.load(row), one, best);
                simd.store(sum, row);
                seen = RunningRange::include(simd, seen, sum, grid.cols - x);
            }
        }
        running.store(simd, seen);
    }
}
