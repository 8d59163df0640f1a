//! Joins the poses of the views, determines the identities of people, and sends them.

use core::time::Duration;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use geometry::Camera;
use messages::{Sightings, Span, topic};
use pipeline::{ViewSightings, WhoSettings, WhoStep, time_s};
use runtime::{Place, Service};
use stage::{Frame, Stage};

/// The settings of the process, for people found by networks.
#[derive(Debug)]
pub struct WhoJob {
    /// Cameras of the views, in the rig's order.
    pub cameras: Vec<Camera>,
    /// Settings for the identities of people.
    pub settings: WhoSettings,
    /// Frames of the footage per second, if known.
    pub frame_rate_hz: Option<f64>,
    /// Interval between used frames, in frames of the footage, at least 1.
    pub frame_step: u64,
    /// Number of processes that receive the people.
    pub n_consumers: usize,
    /// Time that a view may be silent.
    pub patience: Duration,
}

/// Determines the identities of people in every frame, until the footage of all views ends or a stop is requested.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run_who(service: &Service, job: &WhoJob) -> Result<(), Failure> {
    let n_views = job.cameras.len();
    let mut stage = Stage::new(service, job.patience);
    stage.skip_when_behind(job.frame_step);
    for view in 0..n_views {
        // Identities do not depend on extra keypoints.
        stage.view_input(&topic::sightings(view), view, |pose: &Sightings| {
            let n_extras = pose.n_keypoints as usize;
            wire::sightings_from_message(pose, n_extras)
        })?;
    }
    let people = stage.output(&topic::people(), job.n_consumers)?;
    let settings = WhoSettings {
        n_restarts: u64::from(service.epoch()),
        ..job.settings
    };
    let mut place = Place::of(service.bus());
    let mut step = begin(service, job, settings, &mut place);
    // If this process dies before the first frame, no identity was sent yet.
    let mut is_noted = note(&mut place, &step, true);
    stage.run(|frame| {
        let answers: Vec<Option<ViewSightings>> =
            (0..n_views).map(|view| answer(service, frame, view)).collect();
        let present = answers.iter().enumerate();
        let present = present.filter(|(_, answer)| answer.is_some());
        let present = present.fold(0, |mask, (view, _)| mask | 1_u32 << view);
        frame.turn().restart(now_nanos());
        let found = step.run(time_s(frame.number(), job.frame_rate_hz), &answers);
        // The identities are saved before they are sent, so that a restarted process knows every identity that was sent.
        is_noted = note(&mut place, &step, is_noted);
        let message = wire::people_to_message(&found, present).or_fail(ExitKind::Run)?;
        people.send_and_account(frame.turn(), 0, message)
    })
}

/// Saves the identities of people, and returns true if that worked. Warns if it does not work any more.
///
/// * `is_noted`: true if it worked the last time.
fn note(place: &mut Place, step: &WhoStep, is_noted: bool) -> bool {
    let noted = place.note_bytes(bytemuck::cast_slice(&step.memory()));
    if let Err(error) = noted.as_ref()
        && is_noted
    {
        tracing::warn!(%error, "cannot save the identities of people: if this process dies, people get new identities");
    }
    noted.is_ok()
}

/// Returns the step. After a restart, it continues with the people and identities of the previous process.
fn begin(service: &Service, job: &WhoJob, settings: WhoSettings, place: &mut Place) -> WhoStep {
    let memory = place.last().filter(|_| service.epoch() > 0);
    let resumed = memory.and_then(|bytes| {
        let numbers: Vec<f64> = bytemuck::pod_collect_to_vec(&bytes);
        WhoStep::resume(job.cameras.clone(), settings, &numbers)
    });
    resumed.unwrap_or_else(|| WhoStep::new(job.cameras.clone(), settings))
}

/// Returns the candidates of a view; `None` if it has none.
fn answer(
    service: &Service,
    frame: &mut Frame<'_, Option<ViewSightings>>,
    view: usize,
) -> Option<ViewSightings> {
    let item = frame.take(view)?;
    let now = frame.turn().received_at();
    let waited = now.saturating_sub(item.timing.sent_at_nanos);
    service.health().spent(Span::WAITING, Some(view), waited);
    item.value
}
