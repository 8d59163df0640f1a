//! The method of networks in one process: pictures or keypoints of all views in, one skeleton out.

use std::sync::Arc;

use fmp::Responses;
use kernels::Rgb8View;
use keypoints::Keypoint;
use multiview::ViewPlan;
use nalgebra::UnitVector3;
use posenetwork::LookError;
use rayon::prelude::*;

use crate::{
    Estimate, Follow, NetworkMemory, NetworkStep, SpaceStep, SpaceStepSettings, ViewEstimate,
    ViewResult, WhoStep,
};

/// Settings of all steps but those of the views.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NetworkEstimatorSettings {
    /// Which of several people is followed.
    pub follow: Follow,
    /// The step in space.
    pub space: SpaceStepSettings,
    /// Number of the first frame.
    pub start_frame: u64,
    /// Distance between frames, at least 1.
    pub frame_step: u64,
    /// Frames per second, if that is known: without it nothing is moved from the time of its picture to the instant of its frame.
    pub frame_rate_hz: Option<f64>,
    /// Most frames from one in which people are seen to the next one in which they are in their boxes.
    pub most_apart: Option<f64>,
}

/// A view of a frame.
#[derive(Debug, Clone, Copy)]
pub struct ViewFrame<'a> {
    /// What there is of it.
    pub content: ViewContent<'a>,
    /// How long after the instant of the frame the picture was taken, seconds.
    pub skew_s: f64,
}

/// Content of a view of a frame.
#[derive(Debug, Clone, Copy)]
pub enum ViewContent<'a> {
    /// A picture.
    Picture(Rgb8View<'a>),
    /// Keypoints that another program found, by person, pixels of the frame.
    Keypoints(&'a [Vec<Option<Keypoint>>]),
}

/// A view, and what it keeps from frame to frame.
#[derive(Debug)]
struct View {
    step: NetworkStep,
    memory: NetworkMemory,
    responses: Vec<f32>,
}

/// The method of networks in one process.
#[derive(Debug)]
pub struct NetworkEstimator {
    views: Vec<View>,
    who: WhoStep,
    space: SpaceStep,
    settings: NetworkEstimatorSettings,
    /// Number of frames estimated so far.
    n_frames: u64,
}

impl NetworkEstimator {
    /// Prepares the pipeline for a rig.
    ///
    /// * `plans`: the views of the rig, in the rig's order.
    /// * `steps`: one per view.
    pub fn new(
        plans: &[Arc<ViewPlan>],
        steps: Vec<NetworkStep>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: NetworkEstimatorSettings,
    ) -> Self {
        let as_seen = settings.space.space.as_seen;
        let view = |step| View {
            step,
            memory: NetworkMemory::default(),
            responses: Vec::new(),
        };
        Self {
            views: steps.into_iter().map(view).collect(),
            who: WhoStep::new(plans.to_vec(), settings.follow, as_seen),
            space: SpaceStep::new(plans.to_vec(), up_in_world, settings.space.clone()),
            settings,
            n_frames: 0,
        }
    }

    /// Estimates the next frame. The result depends on the frames before. Views run in parallel on the current rayon pool; the result
    /// does not depend on the number of threads.
    ///
    /// * `frames`: one per view; `None` for a view that is missing.
    ///
    /// # Errors
    ///
    /// [`LookError`] if a network or detector fails.
    pub fn estimate(&mut self, frames: &[Option<ViewFrame<'_>>]) -> Result<Estimate, LookError> {
        let frame = self.settings.start_frame + self.n_frames * self.settings.frame_step.max(1);
        self.n_frames += 1;
        let most_apart = self.settings.most_apart;
        let viewed = self.views.par_iter_mut().zip(frames);
        let viewed: Result<Vec<Option<ViewEstimate>>, LookError> = viewed
            .map(|(view, content)| match content {
                Some(content) => view.look(frame, most_apart, content.content),
                None => Ok(None),
            })
            .collect();
        let viewed = viewed?;
        let answers = viewed.iter().zip(frames).map(|(found, frame)| {
            Some(ViewResult {
                skew_s: frame.as_ref()?.skew_s,
                ..found.as_ref()?.result(None)?
            })
        });
        let answers: Vec<Option<ViewResult>> = answers.collect();
        let people = self.who.run(&answers);
        let evidence = self.views.iter().zip(&viewed).map(|(view, found)| {
            let found = found.as_ref()?;
            let layout = view.step.layout();
            let levels = &found.levels;
            Some(Responses::within(
                layout,
                &view.responses,
                levels,
                found.scope,
            ))
        });
        let evidence: Vec<Option<Responses<'_>>> = evidence.collect();
        let rate = self.settings.frame_rate_hz;
        self.space.begin(rate.map(|rate| frame as f64 / rate));
        let skeleton = self.space.run(&answers, &evidence, &people);
        let scopes = viewed.iter().map(|found| Some(found.as_ref()?.scope));
        Ok(Estimate {
            scopes: scopes.collect(),
            start: vec![None; answers.len()],
            answers,
            people,
            pairs: Vec::new(),
            all_views: None,
            skeleton,
        })
    }
}

impl View {
    fn look(
        &mut self,
        frame: u64,
        most_apart: Option<f64>,
        content: ViewContent<'_>,
    ) -> Result<Option<ViewEstimate>, LookError> {
        let scope = match content {
            ViewContent::Picture(image) => {
                self.memory.begin(frame, most_apart);
                self.step.look(image, &mut self.memory)?
            }
            ViewContent::Keypoints(people) => self.step.take(people.iter(), &mut self.memory),
        };
        let Some(scope) = scope else {
            return Ok(None);
        };
        let n_values = self.step.layout().n_values(&scope);
        self.responses
            .resize(self.responses.len().max(n_values), 0.0);
        Ok(Some(self.step.fill(
            scope,
            &mut self.responses,
            &mut self.memory,
        )))
    }
}
