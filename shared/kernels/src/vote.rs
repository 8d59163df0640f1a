//! What a child tells its parent: the best it can contribute, for every place and type of the parent.
//!
//! The distance transform of Felzenszwalb & Huttenlocher 2012 under quadratic springs, the maximum
//! over the child's types and the sum into the parent's scores, row by row in one sweep. The
//! transform looks at every candidate in a window outside of which none can win, instead of walking
//! a lower envelope: cells are independent then, so lanes are cells.

mod fast;
#[cfg(test)]
mod reference;
mod trace;

use crate::isa::{Isa, Kind};
use crate::spring::Spring;

pub use fast::VoteWorkspace;
pub use trace::Found;

/// Scores are kept in rows of a multiple of this many cells.
pub const ROW_ALIGN: usize = 16;

/// The size of score planes: `types x rows x stride`, of which the first `cols` of a row count.
///
/// The cells after them hold minus infinity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Height, cells.
    pub rows: usize,
    /// Width, cells.
    pub cols: usize,
}

impl Grid {
    /// Length of a row in memory: `cols`, rounded up to [`ROW_ALIGN`].
    pub fn stride(&self) -> usize {
        self.cols.next_multiple_of(ROW_ALIGN)
    }

    /// Length of a plane in memory.
    pub fn plane(&self) -> usize {
        self.rows * self.stride()
    }

    /// Where a cell lies in its plane.
    pub fn at(&self, y: usize, x: usize) -> usize {
        y * self.stride() + x
    }
}

/// The scores of a child, votes of its own children included.
#[derive(Debug, Clone, Copy)]
pub struct ChildScores<'a> {
    /// Size of the planes.
    pub grid: Grid,
    /// One plane per type; no NaN.
    pub planes: &'a [f32],
    /// [`spread`] of every plane.
    pub spreads: &'a [f32],
}

/// How a child votes: which springs it may hang on, and what each pair of types is worth.
#[derive(Debug, Clone, PartialEq)]
pub struct VoteRule {
    n_child_types: usize,
    /// `(child type, spring)`.
    springs: Vec<(usize, Spring)>,
    /// For every parent type the springs it may choose from and their biases, by child type.
    choices: Vec<Vec<(usize, f32)>>,
}

impl VoteRule {
    /// Makes a rule.
    ///
    /// * `n_child_types`: number of the child's score planes.
    /// * `springs`: child type and spring of every transform.
    /// * `choices`: for every parent type, index into `springs` and bias; earlier ones win ties. A
    ///   parent type without choices, or with biases of minus infinity only, is impossible.
    ///
    /// # Panics
    ///
    /// If an index is out of range, or a quadratic weight is not positive.
    pub fn new(
        n_child_types: usize,
        springs: Vec<(usize, Spring)>,
        choices: Vec<Vec<(usize, f32)>>,
    ) -> Self {
        for (child_type, spring) in &springs {
            assert!(*child_type < n_child_types, "a spring of an existing type");
            assert!(spring.w[0] > 0.0 && spring.w[2] > 0.0, "springs pull");
        }
        for (spring, _) in choices.iter().flatten() {
            assert!(*spring < springs.len(), "a choice of an existing spring");
        }
        Self {
            n_child_types,
            springs,
            choices,
        }
    }

    /// Adds the child's vote to every cell of the parent's score planes:
    ///
    /// `parent[l][p] += max over choices (k, s) of l: (max over v: child[k][v] + s(p, v)) + bias`,
    /// where `s(p, v)` adds the vertical part of the spring first, then the horizontal one.
    ///
    /// * `parent`: one plane per parent type.
    ///
    /// # Panics
    ///
    /// If the lengths disagree.
    pub fn cast(
        &self,
        isa: Isa,
        child: ChildScores<'_>,
        parent: &mut [f32],
        workspace: &mut VoteWorkspace,
    ) {
        self.check(child);
        let grid = child.grid;
        assert_eq!(
            parent.len(),
            self.choices.len() * grid.plane(),
            "parent planes"
        );
        if grid.plane() == 0 {
            return;
        }
        match isa.0 {
            Kind::Portable => fast::cast(self, child, parent, workspace),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
            Kind::Avx2 => unsafe {
                fast::avx2(self, child, parent, workspace);
            },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
            Kind::Avx512 => unsafe {
                fast::avx512(self, child, parent, workspace);
            },
        }
    }

    fn check(&self, child: ChildScores<'_>) {
        let size = child.grid.plane();
        assert_eq!(
            child.planes.len(),
            self.n_child_types * size,
            "child planes"
        );
        assert_eq!(
            child.spreads.len(),
            self.n_child_types,
            "one spread per child plane"
        );
    }
}

/// Largest difference between two scores of a plane, and a little more.
///
/// The excess, 1e-5 of the scores themselves, is larger than what rounding to single precision can
/// add to or take from a difference. Infinite if some are minus infinity, NaN if all are: both ask for the whole plane to be searched.
pub fn spread(grid: Grid, plane: &[f32]) -> f32 {
    let (mut least, mut most) = ([f32::INFINITY; ROW_ALIGN], [f32::NEG_INFINITY; ROW_ALIGN]);
    for row in plane.chunks_exact(grid.stride().max(1)) {
        let (chunks, rest) = row[..grid.cols].as_chunks::<ROW_ALIGN>();
        for chunk in chunks {
            for lane in 0..ROW_ALIGN {
                least[lane] = if chunk[lane] < least[lane] {
                    chunk[lane]
                } else {
                    least[lane]
                };
                most[lane] = if chunk[lane] > most[lane] {
                    chunk[lane]
                } else {
                    most[lane]
                };
            }
        }
        for (lane, &it) in rest.iter().enumerate() {
            least[lane] = least[lane].min(it);
            most[lane] = most[lane].max(it);
        }
    }
    let most = most.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let least = least.into_iter().fold(f32::INFINITY, f32::min);
    (most - least) + 1e-5 * (most.abs() + least.abs())
}

#[cfg(test)]
mod tests;
