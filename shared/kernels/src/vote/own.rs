//! What a part scores by itself, laid out for the votes.

use std::hint::black_box;

use super::ends::{Ends, Span};
use super::lanes::Lanes;
use super::{Grid, MARGIN};
use crate::isa::{Isa, Kind};

/// The scores of one type of a part before its children vote: `(response + term) + constant`.
#[derive(Debug, Clone, Copy)]
pub struct OwnScores<'a> {
    /// Response of the filter, `rows x cols`.
    pub map: &'a [f32],
    /// Added cell by cell, `rows x cols`.
    pub term: Option<&'a [f32]>,
    /// Added to every cell.
    pub constant: Option<f32>,
}

impl OwnScores<'_> {
    /// Writes a plane and the margin before it, and returns the plane's span.
    ///
    /// * `plane`: [`Grid::len`] of one plane.
    ///
    /// # Panics
    ///
    /// If the lengths disagree.
    pub fn write(&self, isa: Isa, grid: Grid, plane: &mut [f32]) -> Span {
        let cells = grid.rows * grid.cols;
        assert_eq!(self.map.len(), cells, "one response per cell");
        assert!(
            self.term.is_none_or(|it| it.len() == cells),
            "one term per cell"
        );
        assert_eq!(plane.len(), grid.len(1), "one plane");
        if grid.is_empty() {
            return Span::NONE;
        }
        match isa.0 {
            Kind::Portable => write::<[f32; 4]>(self, grid, plane),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
            Kind::Avx2 => unsafe { avx2(self, grid, plane) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
            Kind::Avx512 => unsafe { avx512(self, grid, plane) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(own: &OwnScores<'_>, grid: Grid, plane: &mut [f32]) -> Span {
    write::<std::arch::x86_64::__m256>(own, grid, plane)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn avx512(own: &OwnScores<'_>, grid: Grid, plane: &mut [f32]) -> Span {
    write::<std::arch::x86_64::__m512>(own, grid, plane)
}

#[inline(always)]
fn write<V: Lanes>(own: &OwnScores<'_>, grid: Grid, plane: &mut [f32]) -> Span {
    let (margin, plane) = plane.split_at_mut(MARGIN * grid.stride());
    margin.fill(f32::NEG_INFINITY);
    let sum = Sum {
        own,
        one: V::splat(black_box(1.0)),
        constant: own.constant.map(V::splat),
    };
    let mut ends = Ends::NONE;
    let mut seen = ends.load::<V>();
    let whole = grid.cols - grid.cols % V::N;
    for (y, line) in plane.chunks_exact_mut(grid.stride()).enumerate() {
        let (line, rest) = line.split_at_mut(whole);
        for (run, out) in line.chunks_exact_mut(V::N).enumerate() {
            let at = y * grid.cols + run * V::N;
            let scores = sum.of(|from| V::load(&from[at..]));
            scores.store(out);
            seen = Ends::see(seen, scores, V::N);
        }
        let n = grid.cols - whole;
        for (run, out) in rest.chunks_exact_mut(V::N).enumerate() {
            let mut scores = V::splat(f32::NEG_INFINITY);
            if run == 0 && n > 0 {
                let at = y * grid.cols + whole;
                scores = sum.of(|from| load(from, at, n)).first(n, scores);
                seen = Ends::see(seen, scores, n);
            }
            scores.store(out);
        }
    }
    ends.store(seen);
    ends.span()
}

/// How the scores of a register are summed.
struct Sum<'a, V> {
    own: &'a OwnScores<'a>,
    one: V,
    constant: Option<V>,
}

impl<V: Lanes> Sum<'_, V> {
    #[inline(always)]
    fn of(&self, load: impl Fn(&[f32]) -> V) -> V {
        let mut scores = load(self.own.map);
        if let Some(term) = self.own.term {
            scores = scores.plus(self.one, load(term));
        }
        self.constant.map_or(scores, |it| scores.plus(self.one, it))
    }
}

/// Loads scores of which the first `n` count; there may be no others.
#[inline(always)]
fn load<V: Lanes>(from: &[f32], at: usize, n: usize) -> V {
    if at + V::N <= from.len() {
        return V::load(&from[at..]);
    }
    let mut last = [0.0; super::ROW_ALIGN];
    last[..n].copy_from_slice(&from[at..][..n]);
    V::load(&last)
}
