//! One synchronised set of images in, one skeleton out, without processes.

use std::sync::Arc;

use fmp::{ImageTooSmall, Layout, Model, Responses, Scope, Tracker};
use geometry::Camera;
use kernels::{NoAmx, Rgb8View};
use multiview::{Settings, ViewPlan};
use nalgebra::UnitVector3;
use rayon::prelude::*;

use crate::{
    AllViewsResult, FuseStep, PairResult, PairTables, Skeleton, SkeletonSettings, SkeletonStep,
    Support, ViewEstimate, ViewResult, ViewSettings, ViewStep, Views, all_pairs,
};

/// Why an estimator could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// A view's frames are too small for the model.
    #[error("view {view:?}")]
    TooSmall {
        /// Name of the camera.
        view: String,
        /// How small.
        source: ImageTooSmall,
    },
    /// The machine lacks what the precision needs.
    #[error("precision")]
    Precision(#[from] NoAmx),
}

/// What one set of images gave.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// What every view answered alone.
    pub answers: Vec<Option<ViewResult>>,
    /// The joint start: candidate and exchange of every view.
    pub start: Vec<Option<(usize, bool)>>,
    /// What was searched of every view's image.
    pub scopes: Vec<Option<Scope>>,
    /// What every pair found; empty where all views are solved at once.
    pub pairs: Vec<PairResult>,
    /// What all views found at once, where they are solved so.
    pub all_views: Option<AllViewsResult>,
    /// The result.
    pub skeleton: Skeleton,
}

/// The whole pipeline in one process.
#[derive(Debug)]
pub struct Estimator {
    views: Vec<ViewStep>,
    solved_in: Views,
    fuse: FuseStep,
    skeleton: SkeletonStep,
    plans: Vec<Arc<ViewPlan>>,
    responses: Vec<Vec<f32>>,
    /// One per view.
    trackers: Vec<Tracker>,
    /// Frames so far.
    n_frames: u64,
}

impl Estimator {
    /// Prepares the pipeline for a rig.
    ///
    /// * `cameras`: the cameras of the frames, after resizing and turning, in the rig's order; the
    ///   frames' size is the camera's.
    ///
    /// # Errors
    ///
    /// [`EstimatorError`].
    pub fn new(
        model: &Arc<Model>,
        cameras: &[Camera],
        up_in_world: Option<UnitVector3<f64>>,
        settings: &EstimatorSettings,
    ) -> Result<Self, EstimatorError> {
        let plans = cameras
            .iter()
            .map(|camera| plan(model, camera))
            .collect::<Result<Vec<_>, _>>()?;
        let steps: Vec<ViewStep> = plans
            .iter()
            .map(|it| {
                let layout = Arc::new(it.layout().clone());
                ViewStep::new(Arc::clone(model), layout, settings.view)
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            responses: vec![Vec::new(); steps.len()],
            trackers: steps.iter().map(ViewStep::tracker).collect(),
            n_frames: 0,
            views: steps,
            solved_in: settings.views,
            fuse: FuseStep::new(
                Arc::clone(model),
                settings.fuse.clone(),
                plans.clone(),
                settings.tables.clone(),
            ),
            skeleton: SkeletonStep::new(plans.clone(), up_in_world, settings.skeleton.clone()),
            plans,
        })
    }

    /// The prepared views.
    pub fn plans(&self) -> &[Arc<ViewPlan>] {
        &self.plans
    }

    /// Estimates the next frame: where poses are followed, it depends on the frames before it. Runs views
    /// and pairs side by side on rayon's current pool; the result does not depend on the number of its
    /// threads.
    ///
    /// * `images`: one per view; `None` for a view that is missing.
    /// * `sigma_px`: expected error of every part of every view, where there is a prediction.
    ///
    /// # Panics
    ///
    /// If the number of images, or the size of one, is not that of the rig.
    pub fn estimate(
        &mut self,
        images: &[Option<Rgb8View<'_>>],
        sigma_px: &[Option<Vec<f32>>],
    ) -> Estimate {
        assert_eq!(images.len(), self.views.len(), "one image per view");
        let frame = self.n_frames;
        self.n_frames += 1;
        let viewed: Vec<(Option<ViewResult>, Option<ViewEstimate>)> = self
            .views
            .par_iter()
            .zip(&mut self.responses)
            .zip(&mut self.trackers)
            .enumerate()
            .map(|(view, ((step, responses), tracker))| {
                let Some(image) = images[view] else {
                    return (None, None);
                };
                responses.resize(step.layout().n_responses(), 0.0);
                let mut found = step.run(image, tracker.scope(step.layout(), frame), responses);
                if step.needs_full_search(tracker, &found) {
                    found = step.run(image, Scope::whole(step.layout()), responses);
                }
                step.update(tracker, frame, &found);
                let answer = (!found.candidates.is_empty()).then(|| ViewResult {
                    candidates: found.candidates.clone(),
                    sigma_px: sigma_px.get(view).cloned().flatten(),
                    tau_px: None,
                });
                (answer, Some(found))
            })
            .collect();
        let (answers, found): (Vec<_>, Vec<_>) = viewed.into_iter().unzip();
        let start = self.fuse.start(&answers);
        let evidence = |view: usize| {
            let (layout, found) = (self.plans[view].layout(), found[view].as_ref()?);
            let values = &self.responses[view];
            let evidence = Responses::within(layout, values, &found.levels, found.scope);
            Some(evidence.with_bounds(&found.bounds))
        };
        let evidence: Vec<Option<Responses<'_>>> = (0..found.len()).map(evidence).collect();
        let (pairs, all_views) = match self.solved_in {
            Views::Pairs => (self.pairs(&answers, &evidence, &start), None),
            Views::All => {
                let found = self.fuse.all_views(&answers, &evidence, Support::Mean);
                (Vec::new(), found)
            }
        };
        let scopes = found
            .iter()
            .map(|it| it.as_ref().map(|it| it.scope))
            .collect();
        let skeleton = match &all_views {
            Some(found) => self.skeleton.run_all_views(&answers, found),
            None => self.skeleton.run(&answers, &pairs),
        };
        Estimate {
            answers,
            start,
            scopes,
            pairs,
            all_views,
            skeleton,
        }
    }

    /// What every pair of the views that answered found.
    fn pairs(
        &self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'_>>],
        start: &[Option<(usize, bool)>],
    ) -> Vec<PairResult> {
        let solve = |pair: [usize; 2]| {
            let [first, second] = pair.map(|view| evidence[view].as_ref());
            self.fuse.pair(pair, answers, [first?, second?], start)
        };
        let pairs = all_pairs(self.views.len()).into_par_iter();
        pairs.filter_map(solve).collect()
    }
}

/// Settings of all steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EstimatorSettings {
    /// Of the single-view step.
    pub view: ViewSettings,
    /// What the views of a frame are solved in.
    pub views: Views,
    /// Of the fusion step.
    pub fuse: Settings,
    /// Part-type tables.
    pub tables: PairTables,
    /// Of the last step.
    pub skeleton: SkeletonSettings,
}

/// Prepares a view for a model.
///
/// # Errors
///
/// [`EstimatorError::TooSmall`].
pub fn plan(model: &Arc<Model>, camera: &Camera) -> Result<Arc<ViewPlan>, EstimatorError> {
    let [width, height] = camera.intrinsics.size.map(|it| it as usize);
    let layout = Layout::new(model, width, height).map_err(|source| EstimatorError::TooSmall {
        view: camera.name.clone(),
        source,
    })?;
    let layout = Arc::new(layout);
    Ok(Arc::new(ViewPlan::new(
        camera.clone(),
        Arc::clone(model),
        layout,
    )))
}
