//! Runs the network method in one process: from pictures or keypoints of all views to skeletons.

use std::sync::Arc;

use kernels::Rgb8View;
use keypoints::Keypoint;
use multiview::ViewPlan;
use nalgebra::UnitVector3;
use posenetwork::{LookError, PersonMaps};
use rayon::prelude::*;

use crate::frame_time::time_s;
use crate::{
    FramePeople, NetworkMemory, NetworkStep, PersonSkeleton, SpaceStep, SpaceStepSettings,
    ViewSightings, WhoSettings, WhoStep,
};

/// Settings of all steps except the single-view steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NetworkEstimatorSettings {
    /// Settings of the step that identifies people.
    pub who: WhoSettings,
    /// Settings of the step that solves for the joints in 3D.
    pub space: SpaceStepSettings,
    /// Frame rate, in frames per second, if known. If it is unknown, points are not corrected for the time between their picture and the
    /// frame.
    pub frame_rate_hz: Option<f64>,
    /// Number of frames after which people may have left their boxes.
    pub most_apart: Option<f64>,
    /// Number of runs of the network per frame and view, on average; `None` for no limit.
    pub looks: Option<f64>,
}

/// One view of a frame.
#[derive(Debug, Clone, Copy)]
pub struct ViewFrame<'a> {
    /// The picture or the keypoints of the view.
    pub content: ViewContent<'a>,
    /// Time of the picture after the instant of the frame, in seconds.
    pub skew_s: f64,
}

/// Input that a view provides for a frame.
#[derive(Debug, Clone, Copy)]
pub enum ViewContent<'a> {
    /// The picture of the view.
    Picture(Rgb8View<'a>),
    /// Keypoints found by another program, per person, in pixels of the frame.
    Keypoints(&'a [Vec<Option<Keypoint>>]),
}

/// A view and its state from frame to frame.
#[derive(Debug)]
struct View {
    step: NetworkStep,
    memory: NetworkMemory,
}

/// The result of one frame.
#[derive(Debug, Clone)]
pub struct NetworkEstimate {
    /// The people seen by each view; `None` if the view is missing or nobody is seen in it.
    pub sightings: Vec<Option<ViewSightings>>,
    /// The identified people.
    pub people: FramePeople,
    /// The skeletons of the people, the followed person first.
    pub skeletons: Vec<PersonSkeleton>,
}

/// The network method in one process.
#[derive(Debug)]
pub struct NetworkEstimator {
    views: Vec<View>,
    who: WhoStep,
    space: SpaceStep,
    settings: NetworkEstimatorSettings,
}

impl NetworkEstimator {
    /// Prepares the pipeline for a rig.
    ///
    /// * `plans`: the prepared views, in the rig's order.
    /// * `steps`: the single-view steps, one per view.
    pub fn new(
        plans: &[Arc<ViewPlan>],
        steps: Vec<NetworkStep>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: NetworkEstimatorSettings,
    ) -> Self {
        let cameras = plans.iter().map(|plan| plan.camera().clone()).collect();
        let view = |step| View {
            step,
            memory: NetworkMemory::default(),
        };
        Self {
            views: steps.into_iter().map(view).collect(),
            who: WhoStep::new(cameras, settings.who),
            space: SpaceStep::new(plans.to_vec(), up_in_world, settings.space.clone()),
            settings,
        }
    }

    /// Estimates a frame. The result depends on the earlier frames. Views run in parallel on the current rayon pool; the result
    /// does not depend on the number of threads.
    ///
    /// * `frame`: number of the frame; larger than that of the previous frame.
    /// * `frames`: one per view; `None` for a missing view.
    ///
    /// # Errors
    ///
    /// [`LookError`] if a network or detector fails.
    pub fn estimate(
        &mut self,
        frame: u64,
        frames: &[Option<ViewFrame<'_>>],
    ) -> Result<NetworkEstimate, LookError> {
        let settings = &self.settings;
        let viewed = self.views.par_iter_mut().zip(frames);
        let sightings: Result<Vec<Option<ViewSightings>>, LookError> = viewed
            .map(|(view, content)| match content {
                Some(content) => view.look(frame, settings, content),
                None => Ok(None),
            })
            .collect();
        let sightings = sightings?;
        let people = self.who.run(time_s(frame, self.settings.frame_rate_hz), &sightings);
        let evidence = self.views.iter().zip(&sightings).map(|(view, seen)| {
            let maps = view.step.evidence(&view.memory);
            maps.take(seen.as_ref().map_or(0, |seen| seen.people.len())).collect()
        });
        let evidence: Vec<Vec<PersonMaps<'_>>> = evidence.collect();
        let rate = self.settings.frame_rate_hz;
        self.space.begin(rate.map(|rate| frame as f64 / rate));
        let skeletons = self.space.run(&sightings, &evidence, &people);
        Ok(NetworkEstimate {
            sightings,
            people,
            skeletons,
        })
    }
}

impl View {
    fn look(
        &mut self,
        frame: u64,
        settings: &NetworkEstimatorSettings,
        content: &ViewFrame<'_>,
    ) -> Result<Option<ViewSightings>, LookError> {
        match content.content {
            ViewContent::Picture(image) => {
                self.memory.begin(frame, settings.most_apart);
                self.memory.allow(settings.looks);
                self.step.look(image, &mut self.memory)?;
            }
            ViewContent::Keypoints(people) => self.step.take(people.iter(), &mut self.memory),
        }
        let people = self.step.sightings(&mut self.memory);
        Ok((!people.is_empty()).then_some(ViewSightings {
            people,
            skew_s: content.skew_s,
        }))
    }
}
