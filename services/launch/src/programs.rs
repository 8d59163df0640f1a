//! Description of a running deployment for other programs.

use failure::{ExitKind, Failure, OrFail as _};
use runfiles::{Running, RunningView};
use runtime::Delivery;

use crate::prepare::Prepared;
use crate::resolved::Resolved;

/// Returns the text of the file `deployment.json` beside the sockets of a deployment. It contains the resolved deployment without
/// passwords, and the facts that other programs need to read its messages.
pub(crate) fn description(
    resolved: &Resolved,
    prepared: &Prepared,
    session: u64,
) -> Result<String, Failure> {
    let mut whole = serde_json::to_value(resolved).or_fail(ExitKind::Run)?;
    let own = serde_json::to_value(running(resolved, prepared, session)).or_fail(ExitKind::Run)?;
    if let Some(entries) = whole.as_object_mut() {
        entries.insert(Running::KEY.to_owned(), own);
    }
    let text = serde_json::to_string_pretty(&whole).or_fail(ExitKind::Run)?;
    Ok(footage::without_passwords(&text))
}

fn running(resolved: &Resolved, prepared: &Prepared, session: u64) -> Running {
    let joints = prepared.settings.skeleton.joints;
    let views = prepared.views.iter().map(|view| {
        let [width, height] = view.framing.out_size();
        RunningView {
            height,
            name: view.name.clone(),
            width,
        }
    });
    Running {
        format: Running::VERSION,
        frame_step: resolved.deployment.capture.frame_step,
        joints: joints.joints.iter().map(|joint| joint.name.to_owned()).collect(),
        keypoints: resolved.extra_keypoints.clone(),
        limbs: joints.limbs.iter().map(|limb| [limb.0, limb.1]).collect(),
        lossless: resolved.delivery() == Delivery::Lossless,
        name: resolved.deployment.name.clone(),
        output: resolved.deployment.output.clone(),
        parallax: env!("CARGO_PKG_VERSION").to_owned(),
        session,
        views: views.collect(),
    }
}
