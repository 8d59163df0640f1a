//! How boxes are found for a network in the frames of a deployment.

use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _};
use pipeline::{ViewSettings, ViewStep};

use crate::prepare::Prepared;

/// The search of the filters over the whole frame, which finds boxes for a network.
pub(super) fn filters(prepared: &Prepared, view: usize) -> Result<ViewStep, Failure> {
    let model = inputs::model_or_shipped(None)?;
    let camera = prepared.views[view].framing.camera();
    let plan = pipeline::plan(&model, camera).or_fail(ExitKind::Input)?;
    let layout = Arc::new(plan.layout().clone());
    // More candidates than people: several can be of one, whose boxes are then one.
    Ok(ViewStep::new(model, layout, ViewSettings::default()))
}
