//! Keypoints that another program found in the footage of cameras, and grey frames for cameras that have only keypoints.

use capture::Blank;
use deployment::Deployment;
use deployment::capture::{Camera, Config};
use failure::{ExitKind, Failure, OrFail as _};
use footage::Size;
use keypoints::Sides;
use keypoints::files::NameSet;
use keypoints::keypointfiles::KeypointSource;
use messages::MAX_KEYPOINTS;

use crate::resolved::Resolved;

/// Opens the keypoints of a camera. Returns `None` if the camera has none.
///
/// # Errors
///
/// Fails if the keypoints cannot be read. The message names the file.
pub fn of_camera(camera: &Camera) -> Result<Option<KeypointSource>, Failure> {
    let Some(path) = &camera.keypoints else {
        return Ok(None);
    };
    let names = camera.keypoint_names.as_deref().map(NameSet::of_set);
    let names = names.transpose().or_fail(ExitKind::Config)?;
    let source = KeypointSource::open(path, names).map_err(|error| {
        let hint = format!(
            "these are the `keypoints` of camera {:?}: use a folder with a JSON file for every frame, in the layout of OpenPose, or one JSON \
             file in the layout of COCO; `keypoint_names` gives their names",
            camera.name
        );
        Failure::new(ExitKind::Input, error).with_hint(hint)
    })?;
    Ok(Some(source))
}

/// Properties of the keypoints that the networks and keypoint files of the cameras find.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// Names of all keypoints that are not joints, without repetitions, in the order of the cameras.
    pub(crate) extra: Vec<String>,
    /// True if a network names left and right as seen in the picture.
    pub(crate) as_seen: bool,
}

/// Reads the cards of the networks and the names of the keypoints of a deployment.
///
/// # Errors
///
/// Fails if a card or the names cannot be read, or there are more keypoints than fit into a message.
pub(crate) fn found(deployment: &Deployment) -> Result<Found, Failure> {
    let Found {
        mut extra,
        mut as_seen,
    } = Found::default();
    let mut known = Vec::new();
    for (index, camera) in deployment.cameras.iter().enumerate() {
        let names = if let Some(source) = of_camera(camera)? {
            source.names().names().to_vec()
        } else {
            let network = deployment.pose_network(index);
            if network.is_none() || known.contains(&network) {
                continue;
            }
            known.push(network);
            let card = inputs::network_card(deployment, index)?;
            as_seen |= card.as_ref().is_some_and(|card| card.keypoints.sides == Sides::Seen);
            card.map(|card| card.names()).unwrap_or_default()
        };
        let names = names.into_iter().filter(|name| !::keypoints::is_joint(name));
        for name in names {
            if !extra.contains(&name) {
                extra.push(name);
            }
        }
    }
    if extra.len() > MAX_KEYPOINTS {
        let message = format!(
            "the networks and keypoint files of the cameras have {} different keypoints besides the joints, but at most \
             {MAX_KEYPOINTS} are possible",
            extra.len()
        );
        let hint = "use the same set of keypoints for all cameras";
        return Err(Failure::new(ExitKind::Config, message).with_hint(hint));
    }
    Ok(Found { extra, as_seen })
}

/// Returns the number of frames in the keypoints of every camera, counted from the first frame of the footage; `None` for a camera without
/// keypoints.
pub(crate) fn lengths(deployment: &Deployment) -> Result<Vec<Option<u64>>, Failure> {
    let cameras = deployment.cameras.iter();
    cameras
        .map(|camera| Ok(of_camera(camera)?.map(|keypoints| keypoints.n_frames())))
        .collect()
}

/// Returns the deployment with generated grey frames as the source of every camera that has none. The frames have the image size in the
/// rig, and there are as many as the keypoints need.
///
/// # Errors
///
/// Fails if the frame rate is not given, or the rig lacks the camera.
pub(crate) fn with_pictures(
    mut deployment: Deployment,
    lengths: &[Option<u64>],
) -> Result<Deployment, Failure> {
    if deployment.cameras.iter().all(|camera| !camera.source.is_empty()) {
        return Ok(deployment);
    }
    let rig = inputs::lenses_of(&deployment)?;
    let rate_hz = deployment.capture.frame_rate_hz;
    for (nth, n_frames) in lengths.iter().enumerate() {
        let entry = &deployment.cameras[nth];
        if let (true, Some(n_frames)) = (entry.source.is_empty(), n_frames) {
            let camera = inputs::camera_of(&rig, &entry.name, &deployment)?;
            let [width, height] = camera.intrinsics.size.map(|side| side as usize);
            let grey = grey(&entry.name, Size::new(width, height), *n_frames, rate_hz)?;
            deployment.cameras[nth].source = grey.to_string();
        }
    }
    Ok(deployment)
}

fn grey(name: &str, size: Size, n_frames: u64, rate_hz: Option<f64>) -> Result<Blank, Failure> {
    let rate_hz = rate_hz.ok_or_else(|| {
        let message = format!(
            "camera {name:?} has keypoints without a `source`, and their frame rate is not known"
        );
        let hint = "set `capture.frame_rate_hz` in the deployment to the frame rate of the footage in which they were found";
        Failure::new(ExitKind::Config, message).with_hint(hint)
    })?;
    Ok(Blank {
        size,
        n_frames,
        rate_hz,
    })
}

/// Warns of footage that is longer or shorter than its keypoints.
///
/// * `lengths`: result of [`lengths`].
pub(crate) fn check_lengths(resolved: &Resolved, lengths: &[Option<u64>]) -> Vec<String> {
    let capture = &resolved.deployment.capture;
    let cameras = resolved.deployment.cameras.iter();
    let cameras = cameras.zip(&resolved.footage).zip(lengths);
    let odd = cameras.filter_map(|((camera, footage), n_frames)| {
        let n_frames = (*n_frames)?;
        let n_frames = footage.timeline.map_or(n_frames, |timeline| timeline.n_instants(n_frames));
        let (used, known) = (footage.n_frames, used_of(n_frames, capture));
        let what = match used.cmp(&known) {
            core::cmp::Ordering::Equal => return None,
            core::cmp::Ordering::Greater => "the last frames have no keypoints",
            core::cmp::Ordering::Less => "the last keypoints have no frames",
        };
        Some(format!(
            "camera {:?}: {used} frames of footage and keypoints of {known} frames are used: {what}; both are counted from the \
             first frame: do they begin at the same time?",
            camera.name
        ))
    });
    odd.collect()
}

/// Returns how many of `n_frames` frames are used.
fn used_of(n_frames: u64, capture: &Config) -> u64 {
    let left = n_frames.saturating_sub(capture.start_frame);
    let used = left.div_ceil(capture.frame_step.max(1));
    capture.n_frames.map_or(used, |most| most.min(used))
}

#[cfg(test)]
mod tests;
