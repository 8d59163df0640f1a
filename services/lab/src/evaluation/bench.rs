//! Solves one frame with every version, sharing the single-view solutions and the evidence.

mod learn;

use std::sync::Arc;

use fmp::{Model, Responses, Scope};
use geometry::Camera;
use kernels::Rgb8View;
use multiview::{PairEstimate, ViewPlan};
use nalgebra::UnitVector3;
use pipeline::{
    AllViewsResult, Combine, EstimatorError, Following, FuseStep, Others, PairResult, PairTables,
    Skeleton, SkeletonSettings, SkeletonStep, Support, ViewEstimate, ViewResult, ViewSettings,
    ViewStep, all_pairs, plan,
};
use rayon::prelude::*;
use skeleton::{JointMap, PARSE14};

use crate::evaluation::{Combining, FrameResult, Terms, Version};

/// Configuration of the [`Bench`], without the cameras.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The single-view model.
    pub model: Arc<Model>,
    /// Settings of the single-view step.
    pub view: ViewSettings,
    /// Settings of the skeleton step.
    pub skeleton: SkeletonSettings,
    /// Map from parts to the joints of `skeleton::PARSE14` that are evaluated in images; without it, each joint is the centre of one part.
    pub joint_map: Option<Arc<JointMap>>,
    /// The versions to compare.
    pub trials: Vec<Trial>,
}

/// A version and its settings.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The version.
    pub version: Version,
    /// Settings of fusion. Thresholds have the unit of the expected errors.
    pub fuse: multiview::Settings,
    /// Part-type tables.
    pub tables: PairTables,
}

impl Trial {
    /// Restricts settings with all terms to the terms of a version.
    pub fn of(version: Version, all: &multiview::Settings, tables: &PairTables) -> Self {
        Self {
            version,
            fuse: settings_of(all, version.terms),
            tables: tables.clone(),
        }
    }
}

/// One view of a frame: its image and its single-view poses.
#[derive(Debug, Clone, Copy)]
pub struct SingleView<'a> {
    /// Index of the view.
    pub view: usize,
    /// Frame of the view.
    pub image: Rgb8View<'a>,
    /// Pyramid of the view, and the model.
    pub plan: &'a ViewPlan,
    /// The single-view candidates, at least one.
    pub found: &'a ViewEstimate,
    /// Centres of the 26 parts in the best pose, in pixels of the frame.
    pub centres: &'a [[f64; 2]],
}

/// Expected error of every part in a view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Expectation {
    /// Expected errors, in the unit of the thresholds.
    pub sigma: Vec<f32>,
    /// Thresholds of this view, used if the settings have no thresholds.
    pub tau: Option<Vec<f32>>,
}

/// Predicts the expected error of every part in a view.
pub type ErrorPredictor<'a> = dyn Fn(&SingleView<'_>) -> Option<Expectation> + Sync + 'a;

/// The versions, prepared for the frames of one rig.
#[derive(Debug)]
pub struct Bench {
    setup: Setup,
    up_in_world: Option<UnitVector3<f64>>,
    plans: Vec<Arc<ViewPlan>>,
    views: Vec<ViewStep>,
    responses: Vec<Vec<f32>>,
    /// Fusion step of each version.
    fuse: Vec<FuseStep>,
    footage_from_frame: Vec<[[f64; 3]; 2]>,
}

/// Evidence of all views for one frame.
struct Evidence<'a> {
    answers: Vec<Option<ViewResult>>,
    evidence: Vec<Option<Responses<'a>>>,
}

impl Bench {
    /// Prepares the versions for a rig.
    ///
    /// * `cameras`: cameras of the frames, in the order of the views.
    /// * `footage_from_frame`: map for each camera; see [`Film::footage_from_frame`](crate::evaluation::Film::footage_from_frame).
    ///
    /// # Errors
    ///
    /// Fails with [`EstimatorError`].
    pub fn new(
        setup: Setup,
        cameras: &[Camera],
        up_in_world: Option<UnitVector3<f64>>,
        footage_from_frame: Vec<[[f64; 3]; 2]>,
    ) -> Result<Self, EstimatorError> {
        let plans = cameras.iter().map(|camera| plan(&setup.model, camera));
        let plans: Vec<Arc<ViewPlan>> = plans.collect::<Result<_, _>>()?;
        let views: Vec<ViewStep> = plans
            .iter()
            .map(|plan| {
                let layout = Arc::new(plan.layout().clone());
                ViewStep::new(Arc::clone(&setup.model), layout, setup.view.clone())
            })
            .collect();
        let responses = views.iter().map(|view| vec![0.0; view.layout().n_responses()]);
        let fuse = setup.trials.iter().map(|trial| {
            let model = Arc::clone(&setup.model);
            FuseStep::new(
                model,
                trial.fuse.clone(),
                plans.clone(),
                trial.tables.clone(),
            )
        });
        Ok(Self {
            responses: responses.collect(),
            fuse: fuse.collect(),
            up_in_world,
            plans,
            views,
            setup,
            footage_from_frame,
        })
    }

    /// Returns the cameras of the frames.
    pub fn cameras(&self) -> impl Iterator<Item = &Camera> {
        self.plans.iter().map(|plan| plan.camera())
    }

    /// Solves a frame, on rayon's current pool. Frames are independent, so the result depends only on the
    /// images.
    ///
    /// * `images`: one image for each view; `None` for a missing view.
    /// * Returns the result of each version, in the order of the setup.
    ///
    /// # Panics
    ///
    /// Panics if the number of images or the size of an image does not match the rig.
    pub fn solve(
        &mut self,
        images: &[Option<Rgb8View<'_>>],
        expected: &ErrorPredictor<'_>,
    ) -> Vec<FrameResult> {
        assert_eq!(images.len(), self.views.len(), "one image per view");
        let mut responses = std::mem::take(&mut self.responses);
        let single_views = self.single_views(images, &mut responses);
        let found = {
            let evidence = self.evidence(images, &single_views, &responses, expected);
            let trials = self.setup.trials.par_iter().enumerate();
            trials.map(|(nth, it)| self.version(nth, it.version, &evidence)).collect()
        };
        self.responses = responses;
        found
    }

    /// Solves every view alone.
    fn single_views(
        &self,
        images: &[Option<Rgb8View<'_>>],
        responses: &mut [Vec<f32>],
    ) -> Vec<Option<ViewEstimate>> {
        let views = self.views.par_iter().zip(responses).zip(images);
        let solve = |((step, responses), image): ((&ViewStep, &mut Vec<f32>), &Option<_>)| {
            Some(step.run((*image)?, Scope::whole(step.layout()), responses))
        };
        views.map(solve).collect()
    }

    fn evidence<'a>(
        &'a self,
        images: &[Option<Rgb8View<'_>>],
        found: &'a [Option<ViewEstimate>],
        responses: &'a [Vec<f32>],
        expected: &ErrorPredictor<'_>,
    ) -> Evidence<'a> {
        let answer = |view: usize| {
            let it = found[view].as_ref()?;
            let plan = &self.plans[view];
            let centres = plan.centres(it.candidates.first()?);
            let single = SingleView {
                view,
                image: images[view]?,
                plan,
                found: it,
                centres: &centres,
            };
            let expected = expected(&single);
            Some(ViewResult {
                candidates: it.candidates.clone(),
                front: it.front.clone(),
                tau_px: expected.as_ref().and_then(|expected| expected.tau.clone()),
                sigma_px: expected.map(|expected| expected.sigma),
                skew_s: 0.0,
            })
        };
        let evidence = |view: usize| {
            let it = found[view].as_ref()?;
            let layout = self.plans[view].layout();
            let evidence = Responses::within(layout, &responses[view], &it.levels, it.scope);
            Some(evidence.with_bounds(&it.bounds))
        };
        Evidence {
            answers: (0..self.views.len()).map(answer).collect(),
            evidence: (0..self.views.len()).map(evidence).collect(),
        }
    }

    fn version(&self, nth: usize, version: Version, evidence: &Evidence<'_>) -> FrameResult {
        let step = &self.fuse[nth];
        let answers: Vec<Option<ViewResult>> = evidence
            .answers
            .iter()
            .map(|answer| {
                let mut answer = answer.clone()?;
                // Without adaptive selection, there are no expected errors, and the candidate with the best score comes first.
                answer.sigma_px = answer.sigma_px.filter(|_| version.terms == Terms::Adaptive);
                Some(answer)
            })
            .collect();
        // Frames are independent, so no person was followed before.
        let others = Following::default().others(&self.plans, &answers);
        let combine = match version.combining {
            Combining::Consensus => Combine::Consensus,
            _ => Combine::Mean,
        };
        let settings = SkeletonSettings {
            combine,
            ..self.setup.skeleton.clone()
        };
        let mut last = SkeletonStep::new(self.plans.clone(), self.up_in_world, settings);
        let mut effort = Effort::default();
        let skeleton = match (version.terms, version.combining) {
            (Terms::Single, _) => last.run(&answers, &[]),
            (_, Combining::Pairs | Combining::Consensus) => {
                let pairs = self.pairs(step, &answers, evidence, &others);
                let skeleton = last.run(&answers, &pairs);
                effort.of_pairs(&pairs, &skeleton);
                skeleton
            }
            (_, Combining::AllViews | Combining::AllViewsMean) => {
                let support = match version.combining {
                    Combining::AllViewsMean => Support::Mean,
                    _ => Support::Sum,
                };
                match step.all_views(&answers, &evidence.evidence, &others, support) {
                    Some(all) => {
                        effort.of_all_views(&all);
                        last.run_all_views(&answers, &all)
                    }
                    None => last.run(&answers, &[]),
                }
            }
        };
        self.found(&skeleton, effort)
    }

    fn pairs(
        &self,
        step: &FuseStep,
        answers: &[Option<ViewResult>],
        evidence: &Evidence<'_>,
        others: &Others,
    ) -> Vec<PairResult> {
        let start = step.start(answers, others);
        let solve = |pair: [usize; 2]| {
            let [first, second] = pair.map(|pair| evidence.evidence[pair].as_ref());
            step.pair(pair, answers, [first?, second?], &start)
        };
        let pairs = all_pairs(self.views.len()).into_par_iter();
        pairs.filter_map(solve).collect()
    }

    fn found(&self, skeleton: &Skeleton, effort: Effort) -> FrameResult {
        let joints = skeleton.joints.iter();
        let joints = joints.map(|joint| joint.as_ref().ok().map(|joint| joint.in_world.into()));
        let view = |(view, it): (usize, &Option<pipeline::FusedView>)| {
            let rows = self.footage_from_frame[view];
            let in_footage = |[x, y]: [f64; 2]| rows.map(|row| row[0] * x + row[1] * y + row[2]);
            let centres = &it.as_ref()?.pose.centres_px;
            let joints = match &self.setup.joint_map {
                Some(map) => map.from_parts(centres),
                None => PARSE14.from_parts(centres),
            };
            Some(joints.into_iter().map(in_footage).collect())
        };
        FrameResult {
            joints: joints.collect(),
            views: skeleton.views.iter().enumerate().map(view).collect(),
            iterations: effort.iterations,
            unsettled: effort.unsettled,
            solutions: effort.solutions,
            on: effort.on,
        }
    }
}

/// Computational effort of a version.
#[derive(Debug, Default)]
struct Effort {
    iterations: Vec<u32>,
    unsettled: u32,
    solutions: u32,
    on: Option<f64>,
}

impl Effort {
    /// Counts the iterations of the hypothesis with the highest energy, and the solutions of all hypotheses.
    fn of_all_views(&mut self, all: &AllViewsResult) {
        let estimates = all.hypotheses.iter().map(|hypothesis| &hypothesis.estimate);
        self.solutions = estimates.clone().map(|estimate| estimate.iterations.len() as u32).sum();
        if let Some(it) = estimates.max_by(|a, b| a.energy.total_cmp(&b.energy)) {
            self.count(it.iterations.len(), it.converged);
            self.on = Some(it.active);
        }
    }

    fn count(&mut self, n: usize, converged: bool) {
        self.iterations.push(n as u32);
        self.unsettled += u32::from(!converged);
    }

    /// Counts the iterations of the chosen hypothesis, and the solutions of all hypotheses.
    fn of_pairs(&mut self, pairs: &[PairResult], skeleton: &Skeleton) {
        let (mut on, mut n_terms) = (0, 0);
        for pair in pairs {
            let [first, second] = pair.views.map(|view| {
                let view = skeleton.views[view].as_ref();
                view.is_some_and(|view| view.exchanged)
            });
            let is_taken = |estimate: &&PairEstimate| estimate.start.exchanged == (first != second);
            let taken = pair.hypotheses.iter().find(is_taken);
            if let Some(it) = taken.or(pair.hypotheses.first()) {
                self.count(it.iterations.len(), it.converged);
                on += it.active.iter().filter(|active| **active).count();
                n_terms += it.active.len();
            }
            let all = pair.hypotheses.iter().map(|hypothesis| hypothesis.iterations.len() as u32);
            self.solutions += all.sum::<u32>();
        }
        self.on = (n_terms > 0).then(|| on as f64 / n_terms as f64);
    }
}

/// Returns the settings of a version: the settings with all terms, without the terms that the version does not have.
fn settings_of(all: &multiview::Settings, terms: Terms) -> multiview::Settings {
    let mut settings = all.clone();
    if terms < Terms::Appearance {
        settings.beta = 0.0;
    }
    if terms < Terms::Adaptive {
        settings.tau_px = Vec::new();
        settings.tau_tenths = Vec::new();
        settings.rescue_px = Vec::new();
    }
    settings
}
