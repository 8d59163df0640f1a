//! Lanes are cells of the parent; every lane looks at its candidates in the reference's order.

use std::ops::Range;

use super::{ChildScores, Grid, ROW_ALIGN, VoteRule};
use crate::spring::Axis;

/// Buffers of [`VoteRule::cast`], used again from call to call.
#[derive(Debug, Default)]
pub struct VoteWorkspace {
    stretches: Vec<Stretch>,
    /// A row after the vertical pass, with room for candidates that lie outside on both sides.
    row: Vec<f32>,
    /// A row of every transform.
    transformed: Vec<f32>,
}

/// One transform on one grid.
#[derive(Debug, Default, Clone)]
struct Stretch {
    /// The child's plane.
    plane: usize,
    /// All of the plane is minus infinity.
    impossible: bool,
    down: Offsets,
    along: Offsets,
    /// Children that the vertical pass tries, for every row.
    windows: Vec<Range<usize>>,
    /// Offsets that the horizontal pass tries, for every run of [`ROW_ALIGN`] cells.
    runs: Vec<Range<isize>>,
}

/// What a spring adds at the offsets that are tried on any cell.
#[derive(Debug, Default, Clone)]
struct Offsets {
    first: isize,
    scores: Vec<f32>,
}

impl Offsets {
    fn cover(&mut self, axis: Axis, offsets: Range<isize>) {
        self.first = offsets.start;
        self.scores.clear();
        self.scores.extend(offsets.map(|it| axis.score(it)));
    }

    #[inline(always)]
    fn of(&self, offsets: Range<isize>) -> &[f32] {
        let start = (offsets.start - self.first) as usize;
        &self.scores[start..][..(offsets.end - offsets.start) as usize]
    }
}

fn union(a: Range<isize>, b: Range<isize>) -> Range<isize> {
    a.start.min(b.start)..a.end.max(b.end)
}

impl Stretch {
    fn prepare(&mut self, grid: Grid, (down, along): (Axis, Axis), spread: f32) {
        self.impossible = spread.is_nan();
        let offsets = |window: &Range<usize>, p: usize| {
            window.start as isize - p as isize..window.end as isize - p as isize
        };
        let reach = down.reach(grid.rows, spread);
        self.windows.clear();
        self.windows.extend((0..grid.rows).map(|p| reach.window(p)));
        let all = self.windows.iter().enumerate();
        let all = all.map(|(p, window)| offsets(window, p));
        self.down.cover(down, all.reduce(union).unwrap_or(0..0));
        let reach = along.reach(grid.cols, spread);
        self.runs.clear();
        for first in (0..grid.cols).step_by(ROW_ALIGN) {
            let cells = first..grid.cols.min(first + ROW_ALIGN);
            let run = cells.map(|p| offsets(&reach.window(p), p));
            self.runs.push(run.reduce(union).unwrap_or(0..0));
        }
        let all = self.runs.iter().cloned().reduce(union);
        self.along.cover(along, all.unwrap_or(0..0));
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
pub(super) fn avx2(
    rule: &VoteRule,
    child: ChildScores<'_>,
    parent: &mut [f32],
    workspace: &mut VoteWorkspace,
) {
    cast(rule, child, parent, workspace);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
pub(super) fn avx512(
    rule: &VoteRule,
    child: ChildScores<'_>,
    parent: &mut [f32],
    workspace: &mut VoteWorkspace,
) {
    cast(rule, child, parent, workspace);
}

#[inline(always)]
pub(super) fn cast(
    rule: &VoteRule,
    child: ChildScores<'_>,
    parent: &mut [f32],
    workspace: &mut VoteWorkspace,
) {
    let grid = child.grid;
    let stride = grid.stride();
    let VoteWorkspace {
        stretches,
        row,
        transformed,
    } = workspace;
    stretches.resize_with(rule.springs.len(), Stretch::default);
    for (stretch, (plane, spring)) in stretches.iter_mut().zip(&rule.springs) {
        stretch.plane = *plane;
        stretch.prepare(grid, (spring.y(), spring.x()), child.spreads[*plane]);
    }
    // A run tries all offsets at which one of its cells has a candidate, so the others look at
    // most one run past the ends of the row.
    row.clear();
    row.resize(stride + 2 * ROW_ALIGN, f32::NEG_INFINITY);
    transformed.clear();
    transformed.resize(stretches.len() * stride, f32::NEG_INFINITY);
    for y in 0..grid.rows {
        for (stretch, out) in stretches.iter().zip(transformed.chunks_exact_mut(stride)) {
            if !stretch.impossible {
                let plane = &child.planes[stretch.plane * grid.plane()..][..grid.plane()];
                stretch_down(stretch, (plane, stride), y, &mut row[ROW_ALIGN..]);
                stretch_along(stretch, row, out);
            }
        }
        let rows = parent.chunks_exact_mut(grid.plane());
        for (choices, plane) in rule.choices.iter().zip(rows) {
            add_best(choices, transformed, &mut plane[y * stride..][..stride]);
        }
    }
}

type Run = [f32; ROW_ALIGN];

const IMPOSSIBLE: Run = [f32::NEG_INFINITY; ROW_ALIGN];

/// Replaces `best` by `score + constant` where that is larger.
#[inline(always)]
fn raise(best: &mut Run, score: &Run, constant: f32) {
    for lane in 0..ROW_ALIGN {
        let score = score[lane] + constant;
        best[lane] = if score > best[lane] {
            score
        } else {
            best[lane]
        };
    }
}

#[inline(always)]
fn stretch_down(stretch: &Stretch, (plane, stride): (&[f32], usize), y: usize, out: &mut [f32]) {
    let window = stretch.windows[y].clone();
    let offsets = window.start as isize - y as isize..window.end as isize - y as isize;
    let scores = stretch.down.of(offsets);
    let lines = &plane[window.start * stride..window.end * stride];
    let (out, _) = out[..stride].as_chunks_mut::<ROW_ALIGN>();
    for (run, out) in out.iter_mut().enumerate() {
        let mut best = IMPOSSIBLE;
        for (line, &score) in lines.chunks_exact(stride).zip(scores) {
            let (line, _) = line.as_chunks::<ROW_ALIGN>();
            raise(&mut best, &line[run], score);
        }
        *out = best;
    }
}

#[inline(always)]
fn stretch_along(stretch: &Stretch, row: &[f32], out: &mut [f32]) {
    let (out, _) = out.as_chunks_mut::<ROW_ALIGN>();
    for (run, (offsets, out)) in stretch.runs.iter().zip(out).enumerate() {
        let first = (run * ROW_ALIGN + ROW_ALIGN).wrapping_add_signed(offsets.start);
        let scores = stretch.along.of(offsets.clone());
        let mut best = IMPOSSIBLE;
        for (candidates, &score) in row[first..].array_windows::<ROW_ALIGN>().zip(scores) {
            raise(&mut best, candidates, score);
        }
        *out = best;
    }
}

#[inline(always)]
fn add_best(choices: &[(usize, f32)], transformed: &[f32], out: &mut [f32]) {
    let stride = out.len();
    let (out, _) = out.as_chunks_mut::<ROW_ALIGN>();
    for (run, out) in out.iter_mut().enumerate() {
        let mut best = IMPOSSIBLE;
        for &(spring, bias) in choices {
            let (line, _) = transformed[spring * stride..][..stride].as_chunks::<ROW_ALIGN>();
            raise(&mut best, &line[run], bias);
        }
        for lane in 0..ROW_ALIGN {
            out[lane] += best[lane];
        }
    }
}
