//! The single-view step: pixels in, candidates and evidence out.

use std::ops::Range;
use std::sync::Arc;

use fmp::{
    Bounds, Extractor, FrameTime, Layout, LocalScore, Model, Pose, Precision, Responses, Scope,
    Solver, TrackSettings, Tracker, local_scores,
};
use kernels::{NoAmx, Rgb8View};

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
    /// Those of the searched levels that are offered for these candidates, ascending.
    pub fn levels(self, searched: Range<u16>, candidates: &[Pose]) -> Vec<u16> {
        let offered = |level: u16| match self {
            Self::All => true,
            Self::Around(reach) => candidates
                .iter()
                .any(|it| it.level.abs_diff(level) <= reach),
        };
        searched.filter(|it| offered(*it)).collect()
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
    /// How exactly responses are computed.
    pub precision: Precision,
    /// How poses are followed from frame to frame; every frame is searched in full without it.
    pub track: Option<TrackSettings>,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            window: EvidenceWindow::All,
            n_candidates: 8,
            min_separation: 1.0,
            precision: Precision::F32,
            track: None,
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
    /// How well each part of the best pose fits where it lies; empty without one.
    pub local: Vec<LocalScore>,
    /// What every level can offer at most.
    pub bounds: Bounds,
    /// What was searched, and is covered by the responses.
    pub scope: Scope,
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
    ///
    /// # Errors
    ///
    /// What the machine lacks for the precision.
    pub fn new(
        model: Arc<Model>,
        layout: Arc<Layout>,
        settings: ViewSettings,
    ) -> Result<Self, NoAmx> {
        Ok(Self {
            extractor: Extractor::in_precision(settings.precision, Arc::clone(&model))?,
            solver: Solver::new(model),
            layout,
            settings,
        })
    }

    /// The pyramid of the frames.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Begins to follow poses through the frames of a camera, as the settings say.
    pub fn tracker(&self) -> Tracker {
        Tracker::new(self.settings.track)
    }

    /// Solves one frame within a scope.
    ///
    /// * `scope`: what [`Tracker::scope`] says, or [`Scope::whole`].
    /// * `responses`: [`Layout::n_values`] values of the scope at least, overwritten; may lie in
    ///   shared memory.
    ///
    /// # Panics
    ///
    /// If the image, the scope or `responses` has another size than the layout.
    pub fn run(&self, image: Rgb8View<'_>, scope: Scope, responses: &mut [f32]) -> ViewEstimate {
        let layout = &self.layout;
        self.extractor
            .responses_in(image, layout, &scope, responses);
        let searched: Vec<u16> = scope.levels().collect();
        let evidence = Responses::within(layout, responses, &searched, scope);
        let (candidates, bounds) = self.solver.distinct_and_bounds(
            &evidence,
            self.settings.n_candidates,
            self.settings.min_separation,
        );
        let best = candidates.first();
        let local = best.map(|it| local_scores(self.solver.model(), &evidence, it));
        let levels = self.settings.window.levels(scope.levels(), &candidates);
        ViewEstimate {
            candidates,
            local: local.unwrap_or_default(),
            levels,
            bounds,
            scope,
        }
    }

    /// Whether what was found near the last pose is not to be believed, and the frame is to be searched in
    /// full; see [`Tracker::needs_full_search`].
    pub fn needs_full_search(&self, tracker: &Tracker, found: &ViewEstimate) -> bool {
        tracker.needs_full_search(&self.layout, &found.scope, found.candidates.first())
    }

    /// Tells the tracker what was found in a frame.
    ///
    /// * `at`: as the tracker was asked about.
    pub fn update(&self, tracker: &mut Tracker, at: impl Into<FrameTime>, found: &ViewEstimate) {
        let of = (&**self.solver.model(), &*self.layout);
        tracker.update(of, (at, &found.scope), found.candidates.first());
    }
}
