//! Joins the poses of the views with the identities of people, computes 3D joints from the evidence in shared memory, and sends the
//! results.

use core::time::Duration;
use std::cell::Ref;
use std::collections::BTreeMap;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _};
use messages::{EvidenceHeader, Sightings, Skeletons, topic};
use multiview::ViewPlan;
use pipeline::{ExtrasStep, FramePeople, Motion, SpaceStep, ViewSightings};
use posenetwork::PersonMaps;
use runtime::{Sample, Service};
use stage::{Context, Frame, Held, Output, Stage};
use wire::SolvedPerson;

/// The settings of the process, for people found by networks.
#[derive(Debug)]
pub struct SpaceJob {
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// Step that triangulates the extra keypoints.
    pub extras: ExtrasStep,
    /// Frames of the footage per second, if known. Without it, positions are not corrected for the difference between the capture time of a
    /// picture and the nominal time of its frame.
    pub frame_rate_hz: Option<f64>,
    /// Interval between used frames, in frames of the footage, at least 1.
    pub frame_step: u64,
    /// Number of processes that receive the result.
    pub n_consumers: usize,
    /// Time that a view, or the preceding process, may be silent.
    pub patience: Duration,
}

/// A decoded message.
#[derive(Debug)]
enum Input {
    Seen(Option<ViewSightings>),
    People(FramePeople),
}

/// Computes the 3D joints of every frame, until all inputs end or a stop is requested.
///
/// * `step`: remembers, from frame to frame, which side is left and how long the bones are.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run_in_space(service: &Service, job: &SpaceJob, mut step: SpaceStep) -> Result<(), Failure> {
    let mut stage = Stage::new(service, job.patience);
    stage.skip_when_behind(job.frame_step);
    let n_views = job.plans.len();
    for view in 0..n_views {
        stage.view_input(&topic::sightings(view), view, |pose: &Sightings| {
            wire::sightings_from_message(pose, job.extras.n_keypoints()).map(Input::Seen)
        })?;
    }
    let people = stage.people_input(move |message| {
        wire::people_from_message(message, n_views).map(Input::People)
    })?;
    let held: Result<Vec<_>, Failure> =
        (0..n_views).map(|view| stage.hold_evidence(view, job.frame_step)).collect();
    let solver = Solver {
        service,
        job,
        held: held?,
        people,
        output: stage.output(&topic::skeletons(), job.n_consumers)?,
    };
    // Motions of the extra keypoints, by person.
    let mut motions = BTreeMap::new();
    stage.run(|frame| solver.solve(frame, &mut step, &mut motions))
}

/// The inputs and the output of the process.
struct Solver<'a> {
    service: &'a Service,
    job: &'a SpaceJob,
    held: Vec<Held<f32, EvidenceHeader>>,
    /// Slot of the input with the people.
    people: usize,
    output: Output<'a, Skeletons>,
}

impl Solver<'_> {
    fn solve(
        &self,
        frame: &mut Frame<'_, Input>,
        step: &mut SpaceStep,
        motions: &mut BTreeMap<u64, Motion>,
    ) -> Result<(), Failure> {
        let n_views = self.job.plans.len();
        let answers: Vec<Option<ViewSightings>> =
            (0..n_views).map(|view| seen(frame, view)).collect();
        let people = match frame.take(self.people).map(|item| item.value) {
            Some(Input::People(people)) => people,
            _ => FramePeople::default(),
        };
        let samples: Vec<Option<Ref<'_, Sample<f32, EvidenceHeader>>>> =
            self.held.iter().map(|held| held.of(frame.number())).collect();
        let maps = samples.iter().map(|sample| match sample {
            Some(sample) => self.maps(sample),
            None => Vec::new(),
        });
        let maps: Vec<Vec<PersonMaps<'_>>> = maps.collect();
        let instant_s = self.job.frame_rate_hz.map(|rate| frame.number() as f64 / rate);
        step.begin(instant_s);
        let solved = step.run(&answers, &maps, &people);
        let present = answers.iter().enumerate();
        let present = present.filter(|(_, answer)| answer.is_some());
        let present = present.fold(0, |mask, (view, _)| mask | 1_u32 << view);
        self.service.health().counted_people(people.n_seen as u32);
        motions.retain(|id, _| solved.iter().any(|person| person.id == *id));
        let keypoints = solved.iter().map(|person| {
            let motion = motions.entry(person.id).or_default();
            motion.begin(instant_s);
            self.job.extras.run(&person.skeleton, &answers, motion)
        });
        let keypoints: Vec<Vec<_>> = keypoints.collect();
        let solved = solved.iter().zip(&keypoints);
        let solved = solved.map(|(person, keypoints)| SolvedPerson {
            id: person.id,
            skeleton: &person.skeleton,
            keypoints,
        });
        let solved: Vec<SolvedPerson<'_>> = solved.collect();
        let message = wire::skeletons_to_message(&solved, people.n_seen, present);
        let message = message.or_fail(ExitKind::Run)?;
        self.output.send_and_account(frame.turn(), 0, *message)
    }

    /// Returns the maps of a view. Malformed maps are counted, and an empty list is returned.
    fn maps<'a>(&self, sample: &'a Sample<f32, EvidenceHeader>) -> Vec<PersonMaps<'a>> {
        let context = Context::of(self.service);
        let read = wire::maps_from_message(sample.header(), sample.payload());
        let read = read.inspect_err(|error| context.count_refused("evidence", error));
        read.unwrap_or_default()
    }
}

fn seen(frame: &mut Frame<'_, Input>, view: usize) -> Option<ViewSightings> {
    match frame.take(view)?.value {
        Input::Seen(seen) => seen,
        Input::People(_) => None,
    }
}
