//! The step in 3D: computes the joints of people from the network maps of all views, which are read without copying.

use std::sync::Arc;

use ::people::{Solved, Solver};
use multiview::ViewPlan;
use nalgebra::UnitVector3;
use posenetwork::{MapKind, PersonMaps};
use rayon::prelude::*;

use crate::by_keypoints;
use crate::frame_time::time_s;
use crate::person_step::{FrameViews, PersonStep, Rig, Shown};
use crate::sighting::ViewSightings;
use crate::skeleton_step::Skeleton;
use crate::space_settings::SpaceStepSettings;
use crate::who::FramePeople;

/// Maximum number of people whose bone lengths, left and right are remembered; the people who were seen longest ago are forgotten first.
const MOST_REMEMBERED: usize = 32;

/// A solved person of a frame.
#[derive(Debug, Clone)]
pub struct PersonSkeleton {
    /// Id of the person within the run.
    pub id: u64,
    /// The skeleton; it has no joints if fewer than two views show the person well.
    pub skeleton: Skeleton,
}

/// State that is remembered for a person.
#[derive(Debug)]
struct Remembered {
    id: u64,
    step: PersonStep,
    /// Number of the last frame with the person.
    last: u64,
}

/// The step in 3D, for a rig whose views have network maps; remembers left and right, bone lengths and motion of every person.
#[derive(Debug)]
pub struct SpaceStep {
    rig: Arc<Rig>,
    people: Vec<Remembered>,
    /// The solver for people whose joints were found by other programs.
    solver: Solver,
    n_frames: u64,
    instant_s: Option<f64>,
}

impl SpaceStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order.
    pub fn new(
        plans: Vec<Arc<ViewPlan>>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: SpaceStepSettings,
    ) -> Self {
        let cameras = plans.iter().map(|plan| plan.camera().clone()).collect();
        Self {
            solver: Solver::new(cameras),
            rig: Arc::new(Rig {
                plans,
                up_in_world,
                settings,
            }),
            people: Vec::new(),
            n_frames: 0,
            instant_s: None,
        }
    }

    /// Begins a frame whose pictures may not have been taken at its instant ([`ViewSightings::skew_s`]). The points of the views are then moved
    /// to the instant. Without this call, or if all pictures were taken at the instant, nothing is moved.
    ///
    /// * `instant_s`: instant of the frame, in seconds; `None` if the frame rate is unknown.
    pub fn begin(&mut self, instant_s: Option<f64>) {
        self.instant_s = instant_s;
        self.n_frames += 1;
    }

    /// Solves for the people of a frame, each separately; returns them in their order. Several people run in parallel on the current rayon
    /// pool; the result does not depend on the number of threads.
    ///
    /// * `answers`: sightings of each view; `evidence`: maps of the people of each view. A view without sightings or maps does not
    ///   contribute.
    pub fn run(
        &mut self,
        answers: &[Option<ViewSightings>],
        evidence: &[Vec<PersonMaps<'_>>],
        people: &FramePeople,
    ) -> Vec<PersonSkeleton> {
        let frame = FrameViews {
            answers,
            evidence,
            people,
        };
        for person in &people.people {
            self.remember(person.id);
        }
        let nth_of = |id: u64| people.people.iter().position(|person| person.id == id);
        let instant_s = self.instant_s;
        for known in self.people.iter_mut().filter(|known| nth_of(known.id).is_some()) {
            known.step.begin(instant_s);
        }
        let mut kinds = evidence.iter().flatten().map(|maps| maps.grid().kind);
        let given = kinds.all(|kind| kind == MapKind::Peaks).then(|| self.by_keypoints(&frame));
        let solve = |known: &mut Remembered| {
            let nth = nth_of(known.id)?;
            let skeleton = match &given {
                Some((shown, solved)) => {
                    let given = (&shown[nth][..], solved.get(nth)?);
                    known.step.complete(&frame, given)
                }
                None => known.step.run(&frame, nth),
            };
            Some((
                nth,
                PersonSkeleton {
                    id: known.id,
                    skeleton,
                },
            ))
        };
        // A single person is solved on this thread, without waking another.
        let mut solved: Vec<(usize, PersonSkeleton)> = if people.people.len() > 1 {
            self.people.par_iter_mut().filter_map(solve).collect()
        } else {
            self.people.iter_mut().filter_map(solve).collect()
        };
        solved.sort_by_key(|(nth, _)| *nth);
        solved.into_iter().map(|(_, person)| person).collect()
    }

    /// Solves for the joints of all people from their keypoints. Returns, for each person, the views that show the person, and the joints.
    fn by_keypoints<'a>(
        &mut self,
        frame: &FrameViews<'_, 'a>,
    ) -> (Vec<Vec<Shown<'a>>>, Vec<Solved>) {
        let people = frame.people.people.iter().enumerate();
        let shown = people.map(|(nth, person)| {
            let known = self.people.iter_mut().find(|known| known.id == person.id);
            known.map_or_else(Vec::new, |known| known.step.shown(frame, nth))
        });
        let shown: Vec<Vec<Shown<'a>>> = shown.collect();
        let time_s = self.instant_s.unwrap_or_else(|| time_s(self.n_frames, None));
        let solved = by_keypoints::solve(&mut self.solver, time_s, frame, &shown);
        (shown, solved)
    }

    /// Notes that a person is in the frame; creates the step of a new person.
    fn remember(&mut self, id: u64) {
        let known = self.people.iter().position(|person| person.id == id);
        let index = known.unwrap_or_else(|| {
            if self.people.len() >= MOST_REMEMBERED {
                let oldest = self.people.iter().enumerate();
                let oldest = oldest.min_by_key(|(_, person)| person.last);
                let oldest = oldest.map_or(0, |(index, _)| index);
                self.people.swap_remove(oldest);
            }
            self.people.push(Remembered {
                id,
                step: PersonStep::new(&self.rig),
                last: 0,
            });
            self.people.len() - 1
        });
        self.people[index].last = self.n_frames;
    }
}
