//! What to open, and which of its frames.

use std::path::PathBuf;

/// Footage as a user names it, and which of its frames to hand out.
///
/// Frames are counted from 0 in the order of the footage; those handed out are `start`,
/// `start + step`, `start + 2 step`, ..., `count` of them at most.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceSpec {
    /// One of: a folder of images; a glob (`frames/*.png`); a numbered pattern (`frames/%05d.png`);
    /// an image; a video. A path that exists is taken as it is, whatever characters it contains.
    pub path: String,
    /// First frame, from 0.
    pub start: u64,
    /// Distance between frames, at least 1.
    pub step: u64,
    /// Most frames to hand out; all without it. A still image is handed out this often (once without it).
    pub count: Option<u64>,
    /// Frames per second where the footage does not say: images never do, videos do.
    pub frame_rate_hz: Option<f64>,
    /// Smallest width and height accepted, pixels.
    pub min_side: usize,
    /// The `ffmpeg` executable, a name on the search path or a path.
    pub ffmpeg: PathBuf,
    /// The `ffprobe` executable, a name on the search path or a path.
    pub ffprobe: PathBuf,
}

impl SourceSpec {
    /// All frames of `path`, of any size, with the `ffmpeg` and `ffprobe` on the search path.
    pub fn new(path: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            start: 0,
            step: 1,
            count: None,
            frame_rate_hz: None,
            min_side: 1,
            ffmpeg: "ffmpeg".into(),
            ffprobe: "ffprobe".into(),
        }
    }
}
