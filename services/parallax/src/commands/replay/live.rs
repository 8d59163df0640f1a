//! Replay of a run with live cameras. The cameras are not used: their pictures are read from the recording.

use std::path::Path;

use capture::Recorded;
use deployment::Stage;
use deployment::capture::Mode;
use failure::{ExitKind, Failure};
use launch::Resolved;
use messages::topic;
use recording::Recording;

/// Replaces live cameras by the recording.
///
/// In a replay from capture, no frame is dropped by default, because there is no live camera.
///
/// * `set`: the user's replacements of values.
///
/// # Errors
///
/// Fails if the replay begins with capture, and the recording lacks the pictures of a camera.
pub(super) fn settle(
    recorded: &mut Resolved,
    file: &Path,
    recording: &Recording,
    from: Stage,
    set: &[String],
) -> Result<(), Failure> {
    let live = recorded.live_views();
    if live.is_empty() {
        return Ok(());
    }
    let rate_hz = recorded.instants_hz();
    let step = recorded.deployment.capture.frame_step as f64;
    for &view in &live {
        let camera = &mut recorded.deployment.cameras[view];
        let track = recording.tracks.get(&topic::picture(view));
        if from == Stage::Capture && track.is_none_or(|track| track.entries.is_empty()) {
            let message = format!(
                "{} lacks the pictures of the live camera {:?}, which --from capture needs",
                file.display(),
                camera.name
            );
            let failure = Failure::new(ExitKind::Input, message);
            return Err(failure.with_hint(
                "use `--from pose` to replay the frames that the run used; `parallax record` keeps the pictures, except with `--without camera`",
            ));
        }
        camera.source = Recorded::address(file, &camera.name);
        (camera.format, camera.size, camera.frame_rate_hz) = (None, None, None);
        (camera.transport, camera.clock) = (None, None);
        camera.controls.clear();
        recorded.footage[view].frame_rate_hz = Some(rate_hz / step);
    }
    let capture = &mut recorded.deployment.capture;
    if from == Stage::Capture && !set.iter().any(|setting| setting.starts_with("capture.mode=")) {
        capture.mode = Mode::Lossless;
    }
    Ok(())
}
