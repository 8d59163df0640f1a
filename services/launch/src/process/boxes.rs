//! How boxes are found for a network in the frames of a deployment.

use std::sync::Arc;

use pipeline::{ViewSettings, ViewStep};
use runtime::{ExitKind, Failure, OrFail as _};

use crate::inputs;
use crate::prepare::Prepared;
use crate::resolved::Resolved;

/// In every n-th frame of a view boxes are looked for; n where the deployment does not say.
pub(super) fn find_every(resolved: &Resolved) -> u64 {
    /// Never more often: the network follows who it sees.
    const OFTEN: u64 = 10;
    let pose = &resolved.deployment.pose;
    // People come and go by time: a detector looks twice a second, the filters, which take longer, once.
    let (seconds, at_unknown_rate) = match pose.detector {
        Some(_) => (0.5, OFTEN),
        None => (1.0, 30),
    };
    let step = resolved.deployment.capture.frame_step.max(1) as f64;
    let of_time = |rate: f64| (seconds * rate / step).round().clamp(OFTEN as f64, 1e6) as u64;
    let by_rate = || resolved.frame_rate_hz().map_or(at_unknown_rate, of_time);
    pose.find_every.unwrap_or_else(by_rate)
}

/// The search of the filters over the whole frame, which finds boxes for a network.
pub(super) fn filters(
    resolved: &Resolved,
    prepared: &Prepared,
    view: usize,
) -> Result<ViewStep, Failure> {
    let model = inputs::model_or_shipped(resolved.deployment.model.as_deref())?;
    let camera = prepared.views[view].framing.camera();
    let plan = pipeline::plan(&model, camera).or_fail(ExitKind::Input)?;
    let layout = Arc::new(plan.layout().clone());
    let settings = ViewSettings {
        // More than people: several can be of one, whose boxes are then one.
        n_candidates: resolved.deployment.pose.candidates,
        precision: prepared.settings.view.precision,
        ..ViewSettings::default()
    };
    ViewStep::new(model, layout, settings).or_fail(ExitKind::Config)
}
