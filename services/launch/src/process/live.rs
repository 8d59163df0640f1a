//! Live cameras of a run.

use footage::{LiveAddress, Size};
use scene::{Address, skew_ms_of};

use crate::resolved::Resolved;

/// Returns the settings of a view's live camera, if the view has one.
///
/// * `most_shrink`: maximum factor by which a decoder may shrink the pictures.
pub(super) fn job(
    resolved: &Resolved,
    view: usize,
    most_shrink: usize,
) -> Option<capture::LiveJob> {
    let entry = &resolved.deployment.cameras[view];
    let mut camera = crate::cameras::live_camera(entry)?;
    let footage = &resolved.footage[view];
    if matches!(camera.address, LiveAddress::Stream(_)) {
        // Uses the properties determined before the run, so that a stream need not be queried again.
        let step = resolved.deployment.capture.frame_step as f64;
        camera.rate_hz = footage.frame_rate_hz.map(|frame_rate_hz| frame_rate_hz * step);
    }
    Some(capture::LiveJob {
        camera: capture::LiveCamera {
            most_shrink,
            ..camera
        },
        size: Size::new(footage.size[0] as usize, footage.size[1] as usize),
        rate_hz: resolved.instants_hz(),
        is_kept: resolved
            .recording
            .as_ref()
            .is_some_and(|recording| recording.pictures.contains(&view)),
        name: entry.name.clone(),
        max_skew_nanos: max_skew_nanos(resolved),
        lead_nanos: crate::cameras::lead_nanos(&resolved.deployment),
    })
}

/// Returns the largest difference between the time of a picture and the nominal time of its frame that causes no warning, in nanoseconds:
/// half of the time between two frames.
fn max_skew_nanos(resolved: &Resolved) -> u64 {
    let capture = &resolved.deployment.capture;
    let period_ms = 1e3 * capture.frame_step as f64 / resolved.instants_hz();
    (0.5 * period_ms * 1e6).round() as u64
}

/// Returns the time from the nominal time of a frame until its picture was taken, in nanoseconds, as given by the deployment or the
/// rendered scene.
pub(super) fn skew_nanos(resolved: &Resolved, view: usize) -> i64 {
    let camera = &resolved.deployment.cameras[view];
    let of_scene = || Some(skew_ms_of(&Address::parse(&camera.source).ok()?));
    let skew_ms = camera.skew_ms.or_else(of_scene).unwrap_or(0.0);
    (skew_ms * 1e6).round() as i64
}
