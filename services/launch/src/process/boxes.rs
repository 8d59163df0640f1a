//! How boxes are found for a network in the frames of a deployment.

use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _};
use pipeline::{ViewSettings, ViewStep};

use crate::prepare::Prepared;
use crate::resolved::Resolved;

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
        ..ViewSettings::default()
    };
    Ok(ViewStep::new(model, layout, settings))
}
