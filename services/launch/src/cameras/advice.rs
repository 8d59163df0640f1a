//! Hints for the user if footage cannot be used.

use std::io::ErrorKind;

use capture::FeedError;
use footage::FootageError;

/// Returns the hint for footage that cannot be used.
///
/// * `camera`: the camera of the footage.
pub(super) fn on_footage(error: &FeedError, camera: &str) -> String {
    let camera = format!("camera {camera:?}");
    match error {
        FeedError::Footage(FootageError::Live { .. }) => {
            format!("the `source` of {camera} must be a recorded file or a synth:// scene")
        }
        FeedError::Footage(FootageError::Io { source, .. })
            if source.kind() == ErrorKind::PermissionDenied =>
        {
            format!(
                "this is the `source` of {camera}: you need permission to read it, and to enter (x) every folder above it"
            )
        }
        FeedError::Footage(
            FootageError::ZeroCount
            | FootageError::ZeroStep
            | FootageError::BadRate { .. }
            | FootageError::StartBeyondEnd { .. },
        ) => format!(
            "`capture.start_frame`, `frame_step`, `n_frames` and `frame_rate_hz` set which frames of {camera} are used"
        ),
        FeedError::Footage(FootageError::FfmpegMissing { .. }) => format!(
            "the `source` of {camera} needs both ffmpeg and ffprobe, which come in one package; folders of pictures \
             need neither"
        ),
        FeedError::Footage(
            FootageError::Video { .. } | FootageError::Image { .. } | FootageError::Empty { .. },
        ) => format!(
            "this is the `source` of {camera}; use a video player or `ffprobe FILE` to check that the file is complete"
        ),
        _ => format!(
            "the `source` of {camera} can be a video, an image, a folder of images, a glob or a scene (synth://...). With `keypoints`, \
             it may be left out. \
             Relative paths are relative to the deployment file; comments in this file may state the origin of its data"
        ),
    }
}
