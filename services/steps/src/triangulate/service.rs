//! Joins the poses of views and pairs of views, decides left and right, triangulates, and sends the results.

use core::time::Duration;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _};
use fmp::Pose;
use messages::{PairPose, Sightings, topic};
use multiview::{FrontEvidence, ViewPlan};
use pipeline::{PairResult, Skeleton, SkeletonStep, ViewResult, Views};
use runtime::Service;
use stage::{Frame, Item, Stage};
use wire::{SolvedPerson, WireError};

/// Identity that is reported for the followed person. The paper's method follows only one person, and has no identities.
const UNNAMED: u64 = 1;

/// The settings of the process.
#[derive(Debug)]
pub struct Job {
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// Grouping of the views: solved in pairs, or all at once.
    pub views: Views,
    /// The pairs of the deployment, assigned to the workers in turn. If all views are solved at once, the pairs of the first view with each
    /// other view.
    pub pairs: Vec<[usize; 2]>,
    /// Frames of the footage per second, if known. Without it, positions are not corrected for the difference between the capture time of a
    /// picture and the nominal time of its frame.
    pub frame_rate_hz: Option<f64>,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Number of processes that receive the result.
    pub n_consumers: usize,
    /// Time that a view or a worker may be silent.
    pub patience: Duration,
}

/// Triangulates every frame, until all inputs end or a stop is requested.
///
/// * `step`: keeps the facing direction from the previous frame.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run(service: &Service, job: &Job, mut step: SkeletonStep) -> Result<(), Failure> {
    let n_views = job.plans.len();
    let mut stage = Stage::new(service, job.patience);
    for (view, plan) in job.plans.iter().enumerate() {
        stage.view_input(&topic::sightings(view), view, |pose: &Sightings| {
            let candidates = wire::candidates_from_message(pose, plan.model(), plan.layout())?;
            let front = wire::front_from_message(pose, candidates.len())?;
            Ok(Input::Candidates(Found {
                candidates,
                front,
                skew_s: wire::skew_from_message(pose)?,
            }))
        })?;
    }
    let pairs = stage.pair_inputs(job.n_workers, job.pairs.len(), |pair| {
        decode_pair(job, pair).map(Box::new).map(Input::Pair)
    })?;
    let skeletons = stage.output(&topic::skeletons(), job.n_consumers)?;
    stage.run(|frame| {
        let pairs: Vec<PairInput> = (pairs..pairs + job.pairs.len())
            .filter_map(|slot| match frame.take(slot)?.value {
                Input::Pair(pair) => Some(*pair),
                Input::Candidates(_) => None,
            })
            .collect();
        let views = view_answers(frame, n_views, &pairs);
        let present = (0..n_views).filter(|view| views[*view].is_some());
        let views_present = present.fold(0, |mask, view| mask | 1_u32 << view);
        let rate = job.frame_rate_hz;
        step.begin(rate.map(|rate| frame.number() as f64 / rate));
        let skeleton = skeleton(job.views, &views, pairs, &mut step);
        let n_people = skeleton.n_people as u32;
        service.health().counted_people(n_people);
        let is_somebody = skeleton.views.iter().any(Option::is_some);
        let solved = is_somebody.then_some(SolvedPerson {
            id: UNNAMED,
            skeleton: &skeleton,
            keypoints: &[],
        });
        let message =
            wire::skeletons_to_message(solved.as_slice(), skeleton.n_people, views_present);
        let message = message.or_fail(ExitKind::Run)?;
        skeletons.send_and_account(frame.turn(), 0, *message)
    })
}

/// A decoded message.
#[derive(Debug)]
enum Input {
    Candidates(Found),
    Pair(Box<PairInput>),
}

/// Poses that a view found.
#[derive(Debug)]
struct Found {
    candidates: Vec<Pose>,
    /// For each pose, the evidence in the picture for the direction in which the person faces.
    front: Vec<FrontEvidence>,
    /// Time from the nominal time of the frame until the picture was taken, in seconds.
    skew_s: f64,
}

/// The poses of a pair, and the expected errors of both views that the worker used.
#[derive(Debug)]
struct PairInput {
    views: [usize; 2],
    answer: Option<PairResult>,
    /// Expected errors of both views in pixels, with their age in frames.
    sigma_px: [Option<(u16, Vec<f32>)>; 2],
}

fn decode_pair(job: &Job, message: &PairPose) -> Result<PairInput, WireError> {
    match job.views {
        Views::Pairs => wire::check_views(message, &job.pairs)?,
        Views::All => wire::check_all_views(message, job.plans.len())?,
    }
    let n_parts = job.plans.first().map_or(0, |plan| plan.model().n_parts());
    let sigma_px = |side| wire::sigma_from_pair(message, side, n_parts);
    Ok(PairInput {
        views: message.views.map(|view| view as usize),
        answer: wire::pair_from_message(message, &job.plans)?,
        sigma_px: [sigma_px(0)?, sigma_px(1)?],
    })
}

/// Returns the single-view poses with the expected errors that fusion used. If workers used different errors, returns the latest.
fn view_answers(
    frame: &mut Frame<'_, Input>,
    n_views: usize,
    pairs: &[PairInput],
) -> Vec<Option<ViewResult>> {
    let mut answer = |view: usize| {
        let Some(Item {
            value: Input::Candidates(found),
            ..
        }) = frame.take(view)
        else {
            return None;
        };
        let of_view = pairs.iter().filter_map(|pair| {
            let side = pair.views.iter().position(|other| *other == view)?;
            pair.sigma_px[side].as_ref()
        });
        let latest = of_view.min_by_key(|(age, _)| *age);
        (!found.candidates.is_empty()).then(|| ViewResult {
            candidates: found.candidates,
            front: found.front,
            sigma_px: latest.map(|(_, sigma_px)| sigma_px.clone()),
            tau_px: None,
            skew_s: found.skew_s,
        })
    };
    (0..n_views).map(&mut answer).collect()
}

/// Computes the skeleton from the fused and the single-view poses. A pair is only used if the single-view poses of both views were
/// received here.
fn skeleton(
    solved: Views,
    views: &[Option<ViewResult>],
    pairs: Vec<PairInput>,
    step: &mut SkeletonStep,
) -> Skeleton {
    let is_here = |view: usize| views[view].is_some();
    let mut pairs: Vec<PairResult> = pairs.into_iter().filter_map(|pair| pair.answer).collect();
    if solved == Views::Pairs {
        pairs.retain(|pair| pair.views.iter().all(|&view| is_here(view)));
        return step.run(views, &pairs);
    }
    let all_views = wire::all_views_from_pairs(&pairs)
        .inspect_err(|error| tracing::warn!(%error, "the poses of all views cannot be read"));
    let found = all_views.ok().flatten().and_then(|all| all.only(is_here));
    match found {
        Some(found) => step.run_all_views(views, &found),
        None => step.run(views, &[]),
    }
}
