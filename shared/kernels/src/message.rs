//! Max-sum messages: the best score of a child's subtree for every position and type of the parent.
//!
//! A message is the generalised distance transform of Felzenszwalb & Huttenlocher 2012 under
//! quadratic springs, the maximum over the child's types, and the sum into the parent's scores, row
//! by row in one sweep. The transform evaluates every candidate in a window outside of which none
//! can win, instead of following a lower envelope: cells are then independent, so lanes are cells.

mod buffer;
mod fast;
mod own;
mod range;
#[cfg(test)]
mod reference;
mod trace;
mod transform;

use crate::isa::Isa;
use crate::spring::Spring;

pub use buffer::ScoreBuffer;
pub use fast::MessageWorkspace;
pub use own::OwnScores;
pub use range::ScoreRange;
pub use trace::TracedChild;

/// Scores are kept in rows of a multiple of this many cells.
const ROW_ALIGN: usize = 16;

/// Rows of a plane that are processed together.
const BLOCK: usize = 8;

/// Rows of minus infinity between planes, so that a block may read beyond the grid.
const MARGIN: usize = BLOCK - 1;

/// The size of score planes, and how they lie in memory: `margin, plane, margin, plane, .., margin`.
///
/// A plane has `rows` rows of a length that is rounded up, of which the first `cols` cells count.
/// The other cells, and those of the margins, hold minus infinity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Height, cells.
    pub rows: usize,
    /// Width, cells.
    pub cols: usize,
}

impl Grid {
    /// Length of a row in memory.
    pub fn stride(&self) -> usize {
        self.cols.next_multiple_of(ROW_ALIGN)
    }

    /// Length in memory of some planes, each with the margin before it.
    pub fn len(&self, n_planes: usize) -> usize {
        n_planes * (MARGIN + self.rows) * self.stride()
    }

    /// Length in memory of the margin after the last plane.
    pub fn margin(&self) -> usize {
        MARGIN * self.stride()
    }

    /// Returns true if there are no cells.
    pub fn is_empty(&self) -> bool {
        self.rows == 0 || self.cols == 0
    }

    /// Where a cell of a plane lies in memory.
    pub fn at(&self, plane: usize, y: usize, x: usize) -> usize {
        (plane * (MARGIN + self.rows) + MARGIN + y) * self.stride() + x
    }

    /// The rows of one of some planes.
    pub fn plane<'a>(&self, planes: &'a [f32], plane: usize) -> &'a [f32] {
        &planes[self.at(plane, 0, 0)..][..self.rows * self.stride()]
    }
}

/// The scores of a child, with the messages of its own children added.
#[derive(Debug, Clone, Copy)]
pub struct ChildScores<'a> {
    /// Size of the planes.
    pub grid: Grid,
    /// One plane per type and the margin after the last one; no NaN.
    pub planes: &'a [f32],
    /// Minimum and maximum score of every plane.
    pub ranges: &'a [ScoreRange],
}

/// The rule of a child's message: its springs, and the bias of each pair of types.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageRule {
    n_child_types: usize,
    /// `(child type, spring)`.
    springs: Vec<(usize, Spring)>,
    /// For every parent type the springs that it may use and their biases, by child type.
    choices: Vec<Vec<(usize, f32)>>,
}

impl MessageRule {
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

    /// Adds the child's message to every cell of the parent's score planes:
    ///
    /// `parent[l][p] += max over choices (k, s) of l: (max over v: child[k][v] + s(p, v)) + bias`,
    /// where `s(p, v)` adds the vertical part of the spring first, then the horizontal one.
    ///
    /// * `parent`: one plane per parent type, without the margin after the last one; the minimum
    ///   and maximum score of each are written to `ranges`.
    ///
    /// # Panics
    ///
    /// If the lengths disagree.
    pub fn add_message(
        &self,
        isa: Isa,
        child: ChildScores<'_>,
        (parent, ranges): (&mut [f32], &mut [ScoreRange]),
        workspace: &mut MessageWorkspace,
    ) {
        self.check(child);
        let n_types = self.choices.len();
        assert_eq!(parent.len(), child.grid.len(n_types), "parent planes");
        assert_eq!(ranges.len(), n_types, "one range per parent plane");
        if child.grid.is_empty() {
            return;
        }
        isa.run(fast::AddMessage {
            rule: self,
            child,
            parent: (parent, ranges),
            workspace,
        });
    }

    fn check(&self, child: ChildScores<'_>) {
        let size = child.grid.len(self.n_child_types) + child.grid.margin();
        assert_eq!(child.planes.len(), size, "child planes");
        assert_eq!(
            child.ranges.len(),
            self.n_child_types,
            "one range per child plane"
        );
    }
}

#[cfg(test)]
mod tests;
