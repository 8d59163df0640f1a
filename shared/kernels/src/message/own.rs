//! The own scores of a part, in the layout used for messages.

use std::hint::black_box;

use super::range::{RunningRange, ScoreRange};
use super::{Grid, MARGIN, ROW_ALIGN};
use crate::isa::Isa;
use crate::simd::{Kernel, Simd};

/// The scores of one type of a part before the messages of its children are added: `(response +
/// term) + constant`.
#[derive(Debug, Clone, Copy)]
pub struct OwnScores<'a> {
    /// Responses of the filter, `rows x cols`.
    pub map: &'a [f32],
    /// Terms added to the cells, `rows x cols`.
    pub term: Option<&'a [f32]>,
    /// Constant added to every cell.
    pub constant: Option<f32>,
}

impl OwnScores<'_> {
    /// Writes a plane and the margin before it, and returns the range of the plane's scores.
    ///
    /// * `plane`: memory of [`Grid::len`] for one plane.
    ///
    /// # Panics
    ///
    /// Panics if the lengths do not match.
    pub fn write(&self, isa: Isa, grid: Grid, plane: &mut [f32]) -> ScoreRange {
        let cells = grid.rows * grid.cols;
        assert_eq!(self.map.len(), cells, "one response per cell");
        assert!(
            self.term.is_none_or(|term| term.len() == cells),
            "one term per cell"
        );
        assert_eq!(plane.len(), grid.len(1), "one plane");
        if grid.is_empty() {
            return ScoreRange::NONE;
        }
        let mut running = RunningRange::NONE;
        isa.run(WriteOwnScores {
            own: self,
            grid,
            plane,
            running: &mut running,
        });
        running.range()
    }
}

struct WriteOwnScores<'a> {
    own: &'a OwnScores<'a>,
    grid: Grid,
    plane: &'a mut [f32],
    running: &'a mut RunningRange,
}

impl Kernel for WriteOwnScores<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        *self.running = write(simd, self.own, self.grid, self.plane);
    }
}

/// Writes the plane as described in [`OwnScores::write`].
#[inline(always)]
fn write<S: Simd>(simd: S, own: &OwnScores<'_>, grid: Grid, plane: &mut [f32]) -> RunningRange {
    let (margin, plane) = plane.split_at_mut(MARGIN * grid.stride());
    margin.fill(f32::NEG_INFINITY);
    let sum = Sum {
        simd,
        own,
        one: simd.splat(black_box(1.0)),
        constant: own.constant.map(|constant| simd.splat(constant)),
    };
    let mut running = RunningRange::NONE;
    let mut seen = running.load(simd);
    let whole = grid.cols - grid.cols % S::LANES;
    for (y, line) in plane.chunks_exact_mut(grid.stride()).enumerate() {
        let (line, rest) = line.split_at_mut(whole);
        for (run, out) in line.chunks_exact_mut(S::LANES).enumerate() {
            let at = y * grid.cols + run * S::LANES;
            let scores = sum.total(|from| simd.load(&from[at..]));
            simd.store(scores, out);
            seen = RunningRange::include(simd, seen, scores, S::LANES);
        }
        let n = grid.cols - whole;
        for (run, out) in rest.chunks_exact_mut(S::LANES).enumerate() {
            let mut scores = simd.splat(f32::NEG_INFINITY);
            if run == 0 && n > 0 {
                let at = y * grid.cols + whole;
                scores = simd.first(n, sum.total(|from| load(simd, from, at, n)), scores);
                seen = RunningRange::include(simd, seen, scores, n);
            }
            simd.store(scores, out);
        }
    }
    running.store(simd, seen);
    running
}

/// Sums the scores of a register.
struct Sum<'a, S: Simd> {
    simd: S,
    own: &'a OwnScores<'a>,
    one: S::V,
    constant: Option<S::V>,
}

impl<S: Simd> Sum<'_, S> {
    #[inline(always)]
    fn total(&self, load: impl Fn(&[f32]) -> S::V) -> S::V {
        let mut scores = load(self.own.map);
        if let Some(term) = self.own.term {
            scores = self.simd.plus(scores, self.one, load(term));
        }
        self.constant.map_or(scores, |constant| {
            self.simd.plus(scores, self.one, constant)
        })
    }
}

/// Loads scores. Only the first `n` lanes are used; there may be fewer scores than lanes.
#[inline(always)]
fn load<S: Simd>(simd: S, from: &[f32], at: usize, n: usize) -> S::V {
    if at + S::LANES <= from.len() {
        return simd.load(&from[at..]);
    }
    let mut last = [0.0; ROW_ALIGN];
    last[..n].copy_from_slice(&from[at..][..n]);
    simd.load(&last)
}
