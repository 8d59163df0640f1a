//! Max-sum messages: the best score of a child's subtree for every position and type of the parent.
//!
//! A message is computed in three steps: the generalised distance transform of Felzenszwalb & Huttenlocher 2012 for quadratic springs, the
//! maximum over the child's types, and the addition to the parent's scores. All steps are done in a single pass over the rows. The
//! transform does not follow a lower envelope. It evaluates every candidate in a window that contains all possible winners. Cells are then
//! independent, so each lane of a register computes one cell.

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

/// Rows of scores are padded to a multiple of this number of cells.
const ROW_ALIGN: usize = 16;

/// Number of rows of a plane that are processed together.
const BLOCK: usize = 8;

/// Number of rows of minus infinity between planes, so that a block may read beyond the grid.
const MARGIN: usize = BLOCK - 1;

/// The size of score planes, and their layout in memory: `margin, plane, margin, plane, .., margin`.
///
/// A plane has `rows` rows, whose length is rounded up; only the first `cols` cells of a row are part of the grid. The other cells and the
/// margins contain minus infinity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Height in cells.
    pub rows: usize,
    /// Width in cells.
    pub cols: usize,
}

impl Grid {
    /// Length of a row in memory.
    pub fn stride(&self) -> usize {
        self.cols.next_multiple_of(ROW_ALIGN)
    }

    /// Length in memory of `n_planes` planes, each with the margin before it.
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

    /// Index in memory of a cell of a plane.
    pub fn at(&self, plane: usize, y: usize, x: usize) -> usize {
        (plane * (MARGIN + self.rows) + MARGIN + y) * self.stride() + x
    }

    /// The rows of one plane out of `planes`.
    pub fn plane<'a>(&self, planes: &'a [f32], plane: usize) -> &'a [f32] {
        &planes[self.at(plane, 0, 0)..][..self.rows * self.stride()]
    }
}

/// The scores of a child, with the messages of its own children added.
#[derive(Debug, Clone, Copy)]
pub struct ChildScores<'a> {
    /// Size of the planes.
    pub grid: Grid,
    /// One plane per type, and the margin after the last plane; must not contain NaN.
    pub planes: &'a [f32],
    /// Minimum and maximum score of every plane.
    pub ranges: &'a [ScoreRange],
}

/// The rule of a child's message: its springs, and the bias of each pair of types.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageRule {
    n_child_types: usize,
    /// Child type and spring of every transform.
    springs: Vec<(usize, Spring)>,
    /// For every parent type, the allowed springs and their biases, by child type.
    choices: Vec<Vec<(usize, f32)>>,
}

impl MessageRule {
    /// Makes a rule.
    ///
    /// * `n_child_types`: number of the child's score planes.
    /// * `springs`: child type and spring of every transform.
    /// * `choices`: for every parent type, index into `springs` and bias; earlier choices win ties. A
    ///   parent type without choices, or with only biases of minus infinity, is impossible.
    ///
    /// # Panics
    ///
    /// Panics if an index is out of range, or a quadratic weight is not positive.
    pub fn new(
        n_child_types: usize,
        springs: Vec<(usize, Spring)>,
        choices: Vec<Vec<(usize, f32)>>,
    ) -> Self {
        for (child_type, spring) in &springs {
            assert!(
                *child_type < n_child_types,
                "the spring must belong to an existing type"
            );
            assert!(spring.w[0] > 0.0 && spring.w[2] > 0.0, "springs pull");
        }
        for (spring, _) in choices.iter().flatten() {
            assert!(
                *spring < springs.len(),
                "the choice must be an existing spring"
            );
        }
        Self {
            n_child_types,
            springs,
            choices,
        }
    }

    /// Adds the child's message to every cell of the parent's score planes:
    ///
    /// `parent[l][p] += max over choices (k, s) of l: (max over v: child[k][v] + s(p, v)) + bias`, where the vertical part of the spring
    /// `s(p, v)` is added first, then the horizontal part.
    ///
    /// * `parent`: one plane per parent type, without the margin after the last plane. The minimum
    ///   and maximum score of each plane are written to `ranges`.
    ///
    /// # Panics
    ///
    /// Panics if the lengths do not match.
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
        assert_eq!(
            ranges.len(),
            n_types,
            "there must be one range per parent plane"
        );
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
            "there must be one range per child plane"
        );
    }
}

#[cfg(test)]
mod tests;
