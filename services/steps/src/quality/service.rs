//! Predicts the errors of a frame's candidates, and sends them.

use core::time::Duration;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use fmp::{Layout, LocalScore, Model, Pose};
use kernels::Rgb8View;
use messages::{FrameHeader, Sightings, ViewQuality, topic};
use runtime::{Sample, Service};
use stage::{Context, Stage};
use viewquality::{ForecastInput, Forecaster, Predictor};
use wire::WireError;

/// The settings of the process of one view.
#[derive(Debug)]
pub struct Job {
    /// Index of the view.
    pub view: usize,
    /// Source of the expected errors.
    pub source: Source,
    /// Pixels of the frame per pixel of the footage.
    pub frame_scale: f32,
    /// Interval between used frames, in frames of the footage, at least 1.
    pub frame_step: u64,
    /// Number of processes that receive the expected errors.
    pub n_consumers: usize,
    /// Time that the process waits for its receivers.
    pub patience: Duration,
}

/// Source of expected errors.
#[derive(Debug)]
pub enum Source {
    /// A table of errors in pixels of the footage.
    Table(Predictor),
    /// A network that searches the frames.
    Network(Box<NetworkSource>),
}

/// A network, with the model and the pyramid of the view.
#[derive(Debug)]
pub struct NetworkSource {
    /// The network.
    pub forecaster: Forecaster,
    /// The model of the person.
    pub model: Arc<Model>,
    /// The pyramid of the frames.
    pub layout: Arc<Layout>,
}

/// Predicts the expected errors of every frame of one view, until the footage ends or a stop is requested.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run(service: &Service, job: &mut Job) -> Result<(), Failure> {
    let view = job.view;
    let frame_scale = job.frame_scale;
    let mut stage = Stage::new(service, job.patience);
    let poses = stage.view_input(&topic::sightings(view), view, |pose: &Sightings| Ok(*pose))?;
    let frames = match &job.source {
        Source::Table(_) => None,
        Source::Network(_) => Some(stage.hold_frames(view, job.frame_step)?),
    };
    let output = stage.view_output(&topic::view_quality(view), job.n_consumers)?;
    stage.run(|frame| {
        let Some(pose) = frame.item(poses) else {
            return Ok(());
        };
        let mut message = match (&mut job.source, &frames) {
            (Source::Table(predictor), _) => from_table(predictor, frame.number(), frame_scale)?,
            (Source::Network(network), Some(frames)) => {
                let sample = frames.of(frame.number());
                let picture = (frame.number(), sample.as_deref());
                match candidates(network, &pose.value) {
                    Ok(candidates) => predict(network, candidates, picture, frame_scale)?,
                    Err(error) => {
                        Context::of(service).count_refused("sightings", &error);
                        no_prediction()?
                    }
                }
            }
            (Source::Network(_), None) => no_prediction()?,
        };
        message.took_nanos = now_nanos() - frame.turn().received_at();
        output.send_and_account(frame.turn(), view, message)
    })
}

fn from_table(
    predictor: &mut Predictor,
    frame: u64,
    frame_scale: f32,
) -> Result<ViewQuality, Failure> {
    let sigma_px = predictor.sigma_px(frame);
    let sigma_px: Option<Vec<f32>> =
        sigma_px.map(|parts| parts.iter().map(|px| px * frame_scale).collect());
    wire::sigma_to_message(sigma_px.as_deref()).or_fail(ExitKind::Run)
}

/// Returns the message for a frame without a prediction.
fn no_prediction() -> Result<ViewQuality, Failure> {
    wire::sigma_to_message(None).or_fail(ExitKind::Run)
}

/// The candidates of a view, and the scores of the first candidate's parts.
type Candidates = (Vec<Pose>, Vec<LocalScore>);

fn candidates(source: &NetworkSource, pose: &Sightings) -> Result<Candidates, WireError> {
    let candidates = wire::candidates_from_message(pose, &source.model, &source.layout)?;
    let scores = wire::local_from_message(pose, source.model.n_parts())?;
    Ok((candidates, scores))
}

/// Runs the network on the best candidate, on the frame in shared memory. If that fails, the cause is logged, and the message has no
/// prediction. Fusion can still use the view without expected errors.
fn predict(
    source: &mut NetworkSource,
    (candidates, scores): Candidates,
    (frame_number, frame): (u64, Option<&Sample<u8, FrameHeader>>),
    frame_scale: f32,
) -> Result<ViewQuality, Failure> {
    let (model, layout) = (&source.model, &source.layout);
    if candidates.is_empty() {
        return no_prediction();
    }
    let Some(frame) = frame else {
        tracing::debug!(frame_number, "the frame no longer exists");
        return no_prediction();
    };
    let [width, height] = layout.image_size;
    let header = frame.header();
    let has_expected_size = [header.width as usize, header.height as usize] == [width, height];
    let image = match Rgb8View::new(width, height, frame.payload()) {
        Ok(image) if has_expected_size => image,
        _ => {
            tracing::warn!(frame_number, "a frame has the wrong size");
            return no_prediction();
        }
    };
    let seen = ForecastInput {
        image,
        on: (model, layout),
        candidates: &candidates,
        scores: &scores,
        frame_scale: f64::from(frame_scale),
    };
    let forecast = match source.forecaster.run(&seen) {
        Ok(forecast) => forecast,
        Err(error) => {
            tracing::warn!(frame_number, %error, "the errors of a frame cannot be predicted");
            return no_prediction();
        }
    };
    let sigma = Some(forecast.sigma_px.as_slice());
    let mut message = wire::sigma_to_message(sigma).or_fail(ExitKind::Run)?;
    wire::tau_to_message(&mut message, &forecast.tau_px).or_fail(ExitKind::Run)?;
    message.network = source.forecaster.network().fingerprint();
    message.tile = forecast.tile.rectangle().map(|side| side as f32);
    Ok(message)
}
