//! The exact solution of the tree: votes from the leaves to the root, then back.

use std::sync::Arc;

use crate::{Model, Pose, Responses};

/// Terms that another view adds to the score of a part (the `xi` and `lambda` of eq. 3).
///
/// Both are optional per part; a part without them is scored by this view alone.
pub trait Extra: Sync {
    /// Adds this part's position term to `score`, `rows x cols` of the level, the same for every type.
    ///
    /// Returns `false`, and leaves `score` alone, if the part has none.
    fn add_position(&self, part: usize, level: usize, score: &mut [f32]) -> bool;

    /// Score added to every placement of this type of the part.
    fn of_type(&self, part: usize, mixture: usize) -> f32;
}

/// Solves one tree on given evidence. Holds what can be prepared once per model.
#[derive(Debug)]
pub struct Solver {
    #[expect(dead_code, reason = "to be used")]
    model: Arc<Model>,
}

impl Solver {
    /// Prepares `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self { model }
    }

    /// The best pose over the offered levels, with the extra terms if there are any.
    ///
    /// Ties go to the lower level, then to the first cell in row-major order of the reference.
    pub fn best(&self, _evidence: &Responses<'_>, _extra: Option<&dyn Extra>) -> Option<Pose> {
        None
    }
}
