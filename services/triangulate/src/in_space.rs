//! Joins what the views found and who it is, solves over the evidence in place, sends.

use core::time::Duration;
use std::cell::Ref;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _};
use messages::{EvidenceHeader, Skeletons, ViewPose, topic};
use multiview::ViewPlan;
use pipeline::{
    ExtraKeypoint, ExtrasStep, FoundExtras, FramePeople, Motion, SpaceStep, ViewResult,
};
use runtime::{Sample, Service};
use stage::{Context, Frame, Held, Output, Stage};
use wire::{EvidenceView, SolvedPerson};

/// The process's work by the method of networks.
#[derive(Debug)]
pub struct SpaceJob {
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// Triangulates the extra keypoints.
    pub extras: ExtrasStep,
    /// Frames of the footage per second, if that is known: without it nothing is moved from the time of its picture to the instant
    /// of its frame.
    pub frame_rate_hz: Option<f64>,
    /// Distance between the frames used, at least 1.
    pub frame_step: u64,
    /// Processes that receive the result.
    pub n_consumers: usize,
    /// How long a view or the process before may be silent.
    pub patience: Duration,
}

/// A decoded message.
#[derive(Debug)]
enum Input {
    Seen(Option<ViewResult>, Vec<ExtraKeypoint>),
    People(FramePeople),
}

/// Solves every frame in space, until all inputs end or a stop is requested.
///
/// * `step`: keeps the sides and bone lengths of the previous frames.
///
/// # Errors
///
/// What the transport reports.
pub fn run_in_space(service: &Service, job: &SpaceJob, mut step: SpaceStep) -> Result<(), Failure> {
    let mut stage = Stage::new(service, job.patience);
    stage.skip_when_behind(job.frame_step);
    for (view, plan) in job.plans.iter().enumerate() {
        stage.view_input(&topic::view_pose(view), view, |pose: &ViewPose| {
            let seen = wire::seen_from_message(pose, plan)?;
            let n = seen.as_ref().map_or(0, |seen| seen.candidates.len());
            let extras = wire::extras_from_message(pose, job.extras.n_keypoints(), n)?;
            Ok(Input::Seen(seen, extras))
        })?;
    }
    let n_views = job.plans.len();
    let people = stage.people_input(move |message| {
        wire::people_from_message(message, n_views).map(Input::People)
    })?;
    let held: Result<Vec<_>, Failure> = (0..n_views)
        .map(|view| stage.hold_evidence(view, job.frame_step))
        .collect();
    let solver = Solver {
        service,
        job,
        held: held?,
        people,
        output: stage.output(&topic::skeletons(), job.n_consumers)?,
    };
    // Of the extra keypoints.
    let mut motion = Motion::default();
    stage.run(|frame| solver.solve(frame, &mut step, &mut motion))
}

/// The inputs and the output of the process.
struct Solver<'a> {
    service: &'a Service,
    job: &'a SpaceJob,
    held: Vec<Held<f32, EvidenceHeader>>,
    /// Slot of the people.
    people: usize,
    output: Output<'a, Skeletons>,
}

impl Solver<'_> {
    fn solve(
        &self,
        frame: &mut Frame<'_, Input>,
        step: &mut SpaceStep,
        motion: &mut Motion,
    ) -> Result<(), Failure> {
        let n_views = self.job.plans.len();
        let (answers, extras): (Vec<Option<ViewResult>>, Vec<Vec<ExtraKeypoint>>) =
            (0..n_views).map(|view| seen(frame, view)).unzip();
        let people = match frame.take(self.people).map(|item| item.value) {
            Some(Input::People(people)) => people,
            _ => FramePeople::default(),
        };
        let samples: Vec<Option<Ref<'_, Sample<f32, EvidenceHeader>>>> = self
            .held
            .iter()
            .map(|held| held.of(frame.number()))
            .collect();
        let evidence: Vec<Option<EvidenceView<'_>>> = samples
            .iter()
            .zip(&self.job.plans)
            .map(|(sample, plan)| self.evidence(sample.as_deref()?, plan))
            .collect();
        let responses: Vec<_> = evidence
            .iter()
            .map(|view| view.as_ref().map(EvidenceView::responses))
            .collect();
        let instant_s = self
            .job
            .frame_rate_hz
            .map(|rate| frame.number() as f64 / rate);
        step.begin(instant_s);
        let skeleton = step.run(&answers, &responses, &people);
        let present = answers.iter().enumerate();
        let present = present.filter(|(_, answer)| answer.is_some());
        let present = present.fold(0, |mask, (view, _)| mask | 1_u32 << view);
        self.service
            .health()
            .counted_people(skeleton.n_people as u32);
        motion.begin(instant_s);
        let found = found_extras(&answers, &extras);
        let keypoints = self.job.extras.run(&skeleton, &found, motion);
        let solved = people.people.first().map(|person| SolvedPerson {
            id: person.id,
            skeleton: &skeleton,
            keypoints: &keypoints,
        });
        let message = wire::skeletons_to_message(solved.as_slice(), skeleton.n_people, present);
        let message = message.or_fail(ExitKind::Run)?;
        self.output.send_and_account(frame.turn(), 0, *message)
    }

    /// The evidence of a view; `None`, and counted, if it is malformed.
    fn evidence<'a>(
        &self,
        sample: &'a Sample<f32, EvidenceHeader>,
        plan: &'a ViewPlan,
    ) -> Option<EvidenceView<'a>> {
        let values = sample.payload();
        let read = wire::evidence_from_message(sample.header(), values, plan.layout());
        let read = read.and_then(|view| wire::check_maps(values).map(|()| view));
        let context = Context::of(self.service);
        read.inspect_err(|error| context.count_refused("evidence", error))
            .ok()
    }
}

fn seen(frame: &mut Frame<'_, Input>, view: usize) -> (Option<ViewResult>, Vec<ExtraKeypoint>) {
    match frame.take(view).map(|item| item.value) {
        Some(Input::Seen(seen, extras)) => (seen, extras),
        _ => (None, Vec::new()),
    }
}

/// The candidates of every view with their extra keypoints.
pub(crate) fn found_extras<'a>(
    views: &'a [Option<ViewResult>],
    extras: &'a [Vec<ExtraKeypoint>],
) -> Vec<Option<FoundExtras<'a>>> {
    let found = |(view, extras): (&'a Option<ViewResult>, &'a Vec<ExtraKeypoint>)| {
        let view = view.as_ref()?;
        Some(FoundExtras {
            candidates: &view.candidates,
            extras,
            skew_s: view.skew_s,
        })
    };
    views.iter().zip(extras).map(found).collect()
}
