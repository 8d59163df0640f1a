//! Live cameras of a run.

use deployment::Deployment;
use footage::{LiveAddress, Size};

use crate::inputs;
use crate::resolved::Resolved;

/// The live camera of a view, if it is one.
pub(super) fn job(resolved: &Resolved, view: usize) -> Option<capture::LiveJob> {
    let entry = &resolved.deployment.cameras[view];
    let mut camera = inputs::live_camera(entry)?;
    let footage = &resolved.footage[view];
    if matches!(camera.address, LiveAddress::Stream(_)) {
        // What it told before: a stream is not asked again.
        let step = resolved.deployment.capture.frame_step as f64;
        camera.rate_hz = footage.frame_rate_hz.map(|it| it * step);
    }
    Some(capture::LiveJob {
        camera,
        size: Size::new(footage.size[0] as usize, footage.size[1] as usize),
        rate_hz: resolved.instants_hz(),
        lead_nanos: lead_nanos(&resolved.deployment),
    })
}

/// From the beginning of a run to its first frame in real time, nanoseconds: until every process has started, and streams
/// have shown their first picture.
pub(super) fn lead_nanos(deployment: &Deployment) -> u64 {
    const FOOTAGE: u64 = 2_000_000_000;
    const DEVICES: u64 = 3_000_000_000;
    const STREAMS: u64 = 6_000_000_000;
    let cameras = deployment.cameras.iter().filter_map(inputs::live_camera);
    let leads = cameras.map(|it| match it.address {
        LiveAddress::Device(_) => DEVICES,
        LiveAddress::Stream(_) => STREAMS,
    });
    leads.max().unwrap_or(FOOTAGE)
}
