//! Hints for footage that cannot be used.

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
            format!(
                "this is the `source` of {camera}; recorded files and synth:// scenes can be its footage"
            )
        }
        FeedError::Footage(FootageError::Io { source, .. })
            if source.kind() == ErrorKind::PermissionDenied =>
        {
            format!(
                "this is the `source` of {camera}: the user of Parallax must be able to read it, and to enter (x) every folder above it"
            )
        }
        FeedError::Footage(
            FootageError::ZeroCount
            | FootageError::ZeroStep
            | FootageError::BadRate { .. }
            | FootageError::StartBeyondEnd { .. },
        ) => format!(
            "`capture.start_frame`, `frame_step`, `n_frames` and `frame_rate_hz` say which frames are used; this concerns {camera}"
        ),
        FeedError::Footage(FootageError::FfmpegMissing { .. }) => format!(
            "this is for the `source` of {camera}; ffmpeg and ffprobe come in one package, and both are needed; folders of pictures \
             need neither"
        ),
        FeedError::Footage(
            FootageError::Video { .. } | FootageError::Image { .. } | FootageError::Empty { .. },
        ) => format!(
            "this is the `source` of {camera}; a player, or `ffprobe FILE`, shows whether the file is whole"
        ),
        _ => format!(
            "the `source` of {camera} is a video, an image, a folder of images, a glob or a scene (synth://...), or it is left out where there \
             are `keypoints`; \
             relative paths are relative to the deployment file"
        ),
    }
}
