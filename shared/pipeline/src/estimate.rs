//! Runs the paper's method in one process: from one synchronised set of images to one skeleton.

use std::sync::Arc;

use fmp::{ImageTooSmall, Layout, Model, Responses, Scope, Tracker};
use geometry::Camera;
use kernels::Rgb8View;
use multiview::{Settings, ViewPlan};
use nalgebra::UnitVector3;
use rayon::prelude::*;

use crate::{
    AllViewsResult, Follow, Following, FuseStep, PairResult, PairTables, Skeleton,
    SkeletonSettings, SkeletonStep, Support, ViewEstimate, ViewResult, ViewSettings, ViewStep,
    Views, all_pairs,
};

/// Reason why an estimator could not be created.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// The frames of a view are too small for the model.
    #[error("view {view:?}")]
    TooSmall {
        /// Name of the camera.
        view: String,
        /// The sizes of the image and of the model.
        source: ImageTooSmall,
    },
}

/// The result of one set of images.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// The single-view results.
    pub answers: Vec<Option<ViewResult>>,
    /// The candidate of each view from which the joint optimisation starts, and whether its left and right are swapped.
    pub start: Vec<Option<(usize, bool)>>,
    /// The part of every view's image that was searched.
    pub scopes: Vec<Option<Scope>>,
    /// The results of the pairs; empty if all views are solved at once.
    pub pairs: Vec<PairResult>,
    /// The result of solving all views at once, if that method is selected.
    pub all_views: Option<AllViewsResult>,
    /// The resulting skeleton.
    pub skeleton: Skeleton,
}

/// The paper's method in one process.
#[derive(Debug)]
pub struct Estimator {
    views: Vec<ViewStep>,
    solved_in: Views,
    following: Following,
    fuse: FuseStep,
    skeleton: SkeletonStep,
    plans: Vec<Arc<ViewPlan>>,
    responses: Vec<Vec<f32>>,
    /// The trackers, one per view.
    trackers: Vec<Tracker>,
    /// Number of frames estimated so far.
    n_frames: u64,
}

impl Estimator {
    /// Prepares the pipeline for a rig.
    ///
    /// * `cameras`: the cameras of the frames after resizing and rotation, in the rig's order; each camera
    ///   must have the size of its frames.
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
            .map(|plan| {
                let layout = Arc::new(plan.layout().clone());
                ViewStep::new(Arc::clone(model), layout, settings.view.clone())
            })
            .collect();
        Ok(Self {
            responses: vec![Vec::new(); steps.len()],
            trackers: steps.iter().map(ViewStep::tracker).collect(),
            n_frames: 0,
            views: steps,
            solved_in: settings.views,
            following: Following::new(settings.follow),
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

    /// Returns the prepared views.
    pub fn plans(&self) -> &[Arc<ViewPlan>] {
        &self.plans
    }

    /// Estimates the next frame. If poses are tracked, the result depends on the earlier frames.
    /// Views and pairs run in parallel on the current rayon pool; the result does not depend on the
    /// number of threads.
    ///
    /// * `images`: one per view; `None` for a missing view.
    /// * `sigma_px`: expected error of every part of every view, if predicted.
    ///
    /// # Panics
    ///
    /// If the number of images, or the size of an image, does not match the rig.
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
                let estimate = search(step, tracker, (frame, image), responses);
                let sigma_px = sigma_px.get(view).cloned().flatten();
                let answer = estimate.result(sigma_px);
                (answer, Some(estimate))
            })
            .collect();
        let (answers, estimates): (Vec<_>, Vec<_>) = viewed.into_iter().unzip();
        let others = self.following.others(&self.plans, &answers);
        let start = self.fuse.start(&answers, &others);
        let evidence = |view: usize| {
            let (layout, estimate) = (self.plans[view].layout(), estimates[view].as_ref()?);
            let values = &self.responses[view];
            let evidence = Responses::within(layout, values, &estimate.levels, estimate.scope);
            Some(evidence.with_bounds(&estimate.bounds))
        };
        let evidence: Vec<Option<Responses<'_>>> = (0..estimates.len()).map(evidence).collect();
        let all_views = (self.solved_in != Views::Pairs)
            .then(|| self.fuse.all_views(&answers, &evidence, &others, Support::Mean))
            .flatten();
        let pairs = match self.solved_in {
            Views::Pairs => self.pairs(&answers, &evidence, &start),
            Views::All => Vec::new(),
        };
        let skeleton = match &all_views {
            Some(result) => self.skeleton.run_all_views(&answers, result),
            None => self.skeleton.run(&answers, &pairs),
        };
        Estimate {
            answers,
            start,
            scopes: estimates.iter().map(|estimate| Some(estimate.as_ref()?.scope)).collect(),
            pairs,
            all_views,
            skeleton,
        }
    }

    /// Returns the results of all pairs that have a result.
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

/// Searches a view near the last pose, or the whole image if that is not good enough.
fn search(
    step: &ViewStep,
    tracker: &mut Tracker,
    (frame, image): (u64, Rgb8View<'_>),
    responses: &mut Vec<f32>,
) -> ViewEstimate {
    responses.resize(step.layout().n_responses(), 0.0);
    let mut estimate = step.run(image, tracker.scope(step.layout(), frame), responses);
    if step.needs_full_search(tracker, &estimate) {
        estimate = step.run(image, Scope::whole(step.layout()), responses);
    }
    step.update(tracker, frame, &estimate);
    estimate
}

/// Settings of all steps of the paper's method.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EstimatorSettings {
    /// Settings of the single-view step.
    pub view: ViewSettings,
    /// States whether views are solved in pairs or all at once.
    pub views: Views,
    /// The person to follow if there are several.
    pub follow: Follow,
    /// Settings of the fusion step.
    pub fuse: Settings,
    /// Part-type tables of the pairs of views.
    pub tables: PairTables,
    /// Settings of the skeleton step.
    pub skeleton: SkeletonSettings,
}

/// Prepares a view for a model.
///
/// # Errors
///
/// [`EstimatorError::TooSmall`].
pub fn plan(model: &Arc<Model>, camera: &Camera) -> Result<Arc<ViewPlan>, EstimatorError> {
    let [width, height] = camera.intrinsics.size.map(|side| side as usize);
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
