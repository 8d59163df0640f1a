//! The single-view step of a camera: searches the pictures with a network or with filters, or reads another program's keypoints.

use std::sync::Arc;
use steps::pose;

use failure::{ExitKind, Failure, OrFail as _};
use pipeline::{Eyes, NetworkSettings, NetworkStep, ViewStep};

use crate::device::on_device;
use crate::find_every::FindEvery;
use crate::keypoints;
use crate::prepare::Prepared;
use crate::resolved::Resolved;

/// Returns the single-view step of a camera whose pictures a network searches, as in the process of that camera. Returns `None` if the
/// filters search the pictures, or another program found the keypoints.
///
/// # Errors
///
/// Fails if the model, network or rig cannot be read or used.
pub fn network_step(resolved: &Resolved, view: usize) -> Result<Option<NetworkStep>, Failure> {
    let prepared = Prepared::new(resolved)?;
    Ok(match of_view(resolved, &prepared, view)? {
        pose::Step::Network(step) => Some(*step),
        pose::Step::Filters(_) | pose::Step::Keypoints(_) => None,
    })
}

/// Returns the single-view step, by the network of the deployment or by the filters.
pub(crate) fn of_view(
    resolved: &Resolved,
    prepared: &Prepared,
    view: usize,
) -> Result<pose::Step, Failure> {
    let deployment = &resolved.deployment;
    let plan = &prepared.views[view].plan;
    if !deployment.has_maps() {
        let step = ViewStep::new(
            Arc::clone(&prepared.model),
            Arc::new(plan.layout().clone()),
            prepared.settings.view.clone(),
        );
        let step = on_device(step, deployment.device)?;
        return Ok(pose::Step::Filters(Box::new(step)));
    }
    let config = &deployment.network;
    let size = plan.layout().image_size;
    let step = deployment.capture.frame_step.max(1) as f64;
    let rate_hz = resolved.frame_rate_hz().map(|rate_hz| rate_hz / step);
    let find_every = FindEvery::new(config, rate_hz);
    let settings = NetworkSettings {
        n_people: config.people,
        find_every: find_every.alone,
        find_every_of_several: find_every.several,
        find_phase: view as u64 * find_every.alone / deployment.cameras.len().max(1) as u64,
        frame_s: resolved.frame_rate_hz().map_or(0.0, f64::recip),
        least_heat: config.least_heat,
        ..NetworkSettings::default()
    };
    if let Some(source) = keypoints::of_camera(&deployment.cameras[view])? {
        let extras = extras(resolved, source.names().names());
        let eyes = Eyes::Keypoints(::keypoints::joint_ways(source.names().names()));
        let frame_from_source = prepared.views[view].framing.output_from_source();
        return Ok(pose::Step::Keypoints(Box::new(pose::Keypoints {
            step: NetworkStep::new(eyes, size, settings).with_extras(extras),
            source: pose::Source {
                files: source,
                timeline: resolved.footage[view].timeline,
                frame_from_source,
            },
        })));
    }
    let network = inputs::pose_network(deployment, view)?
        .ok_or("the camera has neither a network nor keypoints")
        .or_fail(ExitKind::Config)?;
    let extras = extras(resolved, network.names());
    let eyes = Eyes::Network(Box::new(network), Box::new(inputs::detector(deployment)?));
    let step = NetworkStep::new(eyes, size, settings).with_extras(extras);
    Ok(pose::Step::Network(Box::new(step)))
}

/// Returns, for every extra keypoint of the deployment, its index in the names of a camera.
fn extras(resolved: &Resolved, names: &[String]) -> Vec<Option<usize>> {
    let number = |wanted: &String| names.iter().position(|name| name == wanted);
    resolved.extra_keypoints.iter().map(number).collect()
}
