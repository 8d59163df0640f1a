//! The single-view step: turns a picture into candidate poses and evidence.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use fmp::{
    Bounds, Extractor, FrameTime, Layout, LocalScore, Model, Pose, Responses, Scope, Solver,
    TrackSettings, Tracker, local_scores,
};
use kernels::Rgb8View;
use multiview::FrontEvidence;
use viewquality::orientation::Detector;

use crate::view_result::ViewResult;

/// The levels of the pyramid that a view provides as evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EvidenceWindow {
    /// All levels are provided.
    #[default]
    All,
    /// Only the levels within this distance of the level of a candidate are provided. All candidates count, not only the best one, so that
    /// fusion can correct a view whose best candidate is wrong.
    Around(u16),
}

impl EvidenceWindow {
    /// Returns the searched levels that are provided as evidence for these candidates, in ascending order.
    pub fn levels(self, searched: Range<u16>, candidates: &[Pose]) -> Vec<u16> {
        let offered = |level: u16| match self {
            Self::All => true,
            Self::Around(reach) => {
                candidates.iter().any(|pose| pose.level.abs_diff(level) <= reach)
            }
        };
        searched.filter(|level| offered(*level)).collect()
    }
}

/// Settings of the single-view step.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// Pyramid levels whose responses are provided as evidence.
    pub window: EvidenceWindow,
    /// Maximum number of candidates.
    pub n_candidates: usize,
    /// Minimum mean distance between the part centres of two candidates, in box sides.
    pub min_separation: f64,
    /// Settings for tracking poses from frame to frame; `None` searches every frame in full.
    pub track: Option<TrackSettings>,
    /// Detector of the direction in which a person faces; if `None`, the direction is unknown.
    pub orientation: Option<Arc<Detector>>,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            window: EvidenceWindow::All,
            n_candidates: 8,
            min_separation: 1.0,
            track: None,
            orientation: None,
        }
    }
}

/// The result of the single-view step, without the responses, which are written separately.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewEstimate {
    /// Distinct poses, best first.
    pub candidates: Vec<Pose>,
    /// Evidence of the picture about the direction in which the person of every candidate faces; empty without a detector.
    pub front: Vec<FrontEvidence>,
    /// Levels whose responses are provided as evidence, in ascending order.
    pub levels: Vec<u16>,
    /// How well each part of the best pose fits at its position; empty without a pose.
    pub local: Vec<LocalScore>,
    /// Upper bounds of the scores on every level.
    pub bounds: Bounds,
    /// The part of the image that was searched; the responses cover it.
    pub scope: Scope,
    /// Where the result was computed.
    pub computed_on: ComputedOn,
}

/// Where a frame was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ComputedOn {
    /// On the processor, as configured.
    #[default]
    Processor,
    /// On the GPU, as configured.
    Gpu,
    /// On the processor, because the GPU was lost.
    ProcessorForGpu,
}

impl ViewEstimate {
    /// Returns the result, for a picture taken at the instant of its frame; `None` if nobody was found.
    pub(crate) fn result(&self, sigma_px: Option<Vec<f32>>) -> Option<ViewResult> {
        (!self.candidates.is_empty()).then(|| ViewResult {
            candidates: self.candidates.clone(),
            front: self.front.clone(),
            sigma_px,
            tau_px: None,
            skew_s: 0.0,
        })
    }
}

/// The single-view step for frames of one size.
#[derive(Debug)]
pub struct ViewStep {
    extractor: Extractor,
    solver: Solver,
    layout: Arc<Layout>,
    settings: ViewSettings,
    looking: Mutex<viewquality::orientation::Workspace>,
    /// Searches whole frames while the GPU is available.
    gpu: Option<gpu::View>,
}

/// The candidates of a frame, and the levels of its evidence.
type Searched = (gpu::Found, Vec<u16>);

impl ViewStep {
    /// Prepares the step for frames of one size.
    pub fn new(model: Arc<Model>, layout: Arc<Layout>, settings: ViewSettings) -> Self {
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(model),
            layout,
            settings,
            looking: Mutex::default(),
            gpu: None,
        }
    }

    /// Searches whole frames on a GPU. Parts of frames, and all frames after the GPU is lost, are searched on the processor.
    ///
    /// # Errors
    ///
    /// [`gpu::Unsuitable`] if the GPU cannot be used; also returns the unchanged step.
    pub fn on_gpu(self, device: &Arc<gpu::Device>) -> Result<Self, (Box<Self>, gpu::Unsuitable)> {
        let model = Arc::clone(self.solver.model());
        match gpu::View::new(device, model, Arc::clone(&self.layout)) {
            Ok(gpu) => Ok(Self {
                gpu: Some(gpu),
                ..self
            }),
            Err(error) => Err((Box::new(self), error)),
        }
    }

    /// Returns the pyramid of the frames.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Creates a tracker for the frames of one camera, with the settings of the step.
    pub fn tracker(&self) -> Tracker {
        Tracker::new(self.settings.track)
    }

    /// Solves one frame within a scope.
    ///
    /// * `scope`: from [`Tracker::scope`], or [`Scope::whole`].
    /// * `responses`: at least [`Layout::n_values`] values of the scope, possibly in shared memory. The values of the levels provided as
    ///   evidence are overwritten.
    ///
    /// # Panics
    ///
    /// If the size of the image, the scope or `responses` does not match the layout.
    pub fn run(&self, image: Rgb8View<'_>, scope: Scope, responses: &mut [f32]) -> ViewEstimate {
        let whole = scope == Scope::whole(&self.layout);
        let gpu = self.gpu.as_ref().filter(|_| whole);
        let by_gpu = gpu.map(|gpu| self.search_on_gpu(gpu, image, responses));
        let ((found, levels), computed_on) = match by_gpu {
            Some(Ok(searched)) => (searched, ComputedOn::Gpu),
            Some(Err(gpu::DeviceLost)) => (
                self.search(image, scope, responses),
                ComputedOn::ProcessorForGpu,
            ),
            None => (self.search(image, scope, responses), ComputedOn::Processor),
        };
        let gpu::Found { candidates, bounds } = found;
        let evidence = Responses::within(&self.layout, responses, &levels, scope);
        let best = candidates.first();
        let local = best.map(|pose| local_scores(self.solver.model(), &evidence, pose));
        ViewEstimate {
            front: self.front(image, &candidates),
            candidates,
            local: local.unwrap_or_default(),
            levels,
            bounds,
            scope,
            computed_on,
        }
    }

    /// Searches a scope on the processor.
    fn search(&self, image: Rgb8View<'_>, scope: Scope, responses: &mut [f32]) -> Searched {
        let layout = &self.layout;
        self.extractor.responses_in(image, layout, &scope, responses);
        let searched: Vec<u16> = scope.levels().collect();
        let evidence = Responses::within(layout, responses, &searched, scope);
        let (candidates, bounds) = self.solver.distinct_and_bounds(
            &evidence,
            self.settings.n_candidates,
            self.settings.min_separation,
        );
        let levels = self.settings.window.levels(scope.levels(), &candidates);
        (gpu::Found { candidates, bounds }, levels)
    }

    /// Searches a whole frame on the GPU.
    fn search_on_gpu(
        &self,
        gpu: &gpu::View,
        image: Rgb8View<'_>,
        responses: &mut [f32],
    ) -> Result<Searched, gpu::DeviceLost> {
        let wanted = gpu::Wanted {
            n: self.settings.n_candidates,
            min_separation: self.settings.min_separation,
        };
        let all = 0..self.layout.levels.len() as u16;
        let offered = |candidates: &[Pose]| self.settings.window.levels(all.clone(), candidates);
        let found = gpu.search(image, wanted, &offered, responses)?;
        let levels = offered(&found.candidates);
        Ok((found, levels))
    }

    /// Returns the evidence of the direction in which the person of every candidate faces; empty without a detector.
    fn front(&self, image: Rgb8View<'_>, candidates: &[Pose]) -> Vec<FrontEvidence> {
        let Some(detector) = &self.settings.orientation else {
            return Vec::new();
        };
        let mut workspace = self.looking.lock().unwrap_or_else(PoisonError::into_inner);
        let (model, layout) = (self.solver.model(), &*self.layout);
        let mut of_candidate = |pose: &Pose| {
            let bounds = pose.bounding_box(model, layout);
            match viewquality::orientation::head_of(&pose.centres(model, layout)) {
                Some(head) => detector.evidence(image, bounds, head, &mut workspace),
                None => [0.0; 2],
            }
        };
        candidates.iter().map(&mut of_candidate).collect()
    }

    /// Returns true if the result near the last pose is unreliable, so that the frame must be searched in full. See
    /// [`Tracker::needs_full_search`].
    pub fn needs_full_search(&self, tracker: &Tracker, found: &ViewEstimate) -> bool {
        tracker.needs_full_search(&self.layout, &found.scope, found.candidates.first())
    }

    /// Updates the tracker with the result of a frame.
    ///
    /// * `at`: the time that was passed to [`Tracker::scope`].
    pub fn update(&self, tracker: &mut Tracker, at: impl Into<FrameTime>, found: &ViewEstimate) {
        let of = (&**self.solver.model(), &*self.layout);
        tracker.update(of, (at, &found.scope), found.candidates.first());
    }
}
