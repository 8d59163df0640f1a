//! The single-view step: pixels in, candidates and evidence out.

use std::sync::Arc;

use fmp::{Extractor, Layout, Model, Pose, Responses, Solver};
use kernels::Rgb8View;

/// Which levels of the pyramid a view offers as evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EvidenceWindow {
    /// Every level.
    #[default]
    All,
    /// The levels at most this many away from the level of any candidate: of every candidate, not
    /// only of the best one, so that a view whose own answer is wrong is not trapped.
    Around(u16),
}

impl EvidenceWindow {
    /// The levels offered for these candidates, ascending.
    pub fn levels(self, n_levels: usize, candidates: &[Pose]) -> Vec<u16> {
        let offered = |level: u16| match self {
            Self::All => true,
            Self::Around(reach) => candidates
                .iter()
                .any(|it| it.level.abs_diff(level) <= reach),
        };
        (0..n_levels as u16).filter(|it| offered(*it)).collect()
    }
}

/// Settings of the single-view step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewSettings {
    /// Levels offered as evidence.
    pub window: EvidenceWindow,
    /// Most candidates.
    pub n_candidates: usize,
    /// Least mean distance between the part centres of two candidates, box sides.
    pub min_separation: f64,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            window: EvidenceWindow::All,
            n_candidates: 8,
            min_separation: 1.0,
        }
    }
}

/// What the single-view step found, besides the responses it wrote.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewEstimate {
    /// Distinct poses, best first.
    pub candidates: Vec<Pose>,
    /// Levels whose responses are offered as evidence, ascending.
    pub levels: Vec<u16>,
}

/// The single-view step for frames of one size.
#[derive(Debug)]
pub struct ViewStep {
    extractor: Extractor,
    solver: Solver,
    layout: Arc<Layout>,
    settings: ViewSettings,
}

impl ViewStep {
    /// Prepares the step.
    pub fn new(model: Arc<Model>, layout: Arc<Layout>, settings: ViewSettings) -> Self {
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(model),
            layout,
            settings,
        }
    }

    /// The pyramid of the frames.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Solves one frame.
    ///
    /// * `responses`: [`Layout::n_responses`] values, overwritten; may lie in shared memory.
    ///
    /// # Panics
    ///
    /// If the image or `responses` has another size than the layout.
    pub fn run(&self, image: Rgb8View<'_>, responses: &mut [f32]) -> ViewEstimate {
        self.extractor.responses(image, &self.layout, responses);
        let n_levels = self.layout.levels.len();
        let all: Vec<u16> = (0..n_levels as u16).collect();
        let evidence = Responses::new(&self.layout, responses, &all);
        let candidates = self.solver.distinct(
            &evidence,
            self.settings.n_candidates,
            self.settings.min_separation,
        );
        let levels = self.settings.window.levels(n_levels, &candidates);
        ViewEstimate { candidates, levels }
    }
}
