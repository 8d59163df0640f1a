//! Section `[capture]` of a deployment file, and its `[[camera]]` entries.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::fault::{Fault, FaultError, FaultKind, Faults};

/// Where the pictures of one camera come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The camera of the rig, by its name there.
    pub name: String,
    /// A video, an image, a folder or pattern of images, a camera (`/dev/video0`, `rtsp://...`), a scene (`synth://...`), or a camera of a recording
    /// (`run.mcap#left`).
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// Keypoints that another program found, in place of footage or beside it: a folder with a JSON file for every frame, or one JSON file.
    pub keypoints: Option<PathBuf>,
    /// What the keypoints are called: `coco-17`, `halpe-26`, `body-25`, `body-25b`, `openpose-18`, `mpii-16`, `lsp-14`, `coco-wholebody-133`, `halpe-136` or
    /// `body-135`; without it by their number, or as the file says.
    pub keypoint_names: Option<String>,
    /// A network of this camera's own, in place of `network.file`.
    pub network: Option<PathBuf>,
    /// Place of the source's top-left pixel on the calibrated image, `[x, y]` pixels, for a source that lacks rows or columns of it.
    pub source_offset_px: Option<[u32; 2]>,
    /// Turn of the pictures, degrees to the right (`0`, `90`, `180`, `270`), or `"tag"`, as the file asks; without it as the calibration is.
    pub rotate: Option<Rotate>,
    /// Numbered pictures: the number of frame 0, and the step from frame to frame; without it by the numbers of all cameras.
    pub numbers: Option<[u64; 2]>,
    /// Time to add to those of the footage, milliseconds, so that all cameras have the same clock (`parallax sync estimate`).
    pub offset_ms: Option<f64>,
    /// Millionths by which a second of the camera's clock is too long (`parallax sync estimate`).
    pub drift_ppm: Option<f64>,
    /// Format of a video device's pictures, such as `MJPG` or `YUYV`; without it the first that can be read.
    pub format: Option<String>,
    /// Size of a live camera's pictures, `[width, height]` pixels; without it as the camera is set.
    pub size: Option<[u32; 2]>,
    /// Pictures per second of a live camera; without it as the camera says.
    pub frame_rate_hz: Option<f64>,
    /// Controls of a video device to set before the run, by the names that `parallax cameras` lists.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controls: BTreeMap<String, i64>,
    /// How the packets of an RTSP camera travel; without it as camera and reader agree.
    pub transport: Option<Transport>,
    /// Clock that tells when an RTSP camera took its pictures: its own (`camera`), or that of their `arrival`; without it `camera`.
    pub clock: Option<CameraClock>,
    /// Time from the instants of the frames to when footage was taken, milliseconds, negative for before.
    pub skew_ms: Option<f64>,
    /// Fault of the camera on purpose, for a test, such as `freeze@30+20`.
    #[serde(default, skip_serializing_if = "Faults::is_empty")]
    #[schemars(with = "String")]
    pub fault: Faults,
}

/// How the pictures of footage are turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected 0, 90, 180 or 270 degrees to the right, or \"tag\""
)]
pub enum Rotate {
    /// By so many degrees to the right.
    Degrees(u16),
    /// As the file asks.
    Tag(Tag),
}

/// The word `tag`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Tag {
    /// As the file asks.
    Tag,
}

/// How the packets of an RTSP camera travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Transport {
    /// None is lost, but one that is late delays the others.
    Tcp,
    /// Those that are late are lost.
    Udp,
}

/// By which clock an RTSP camera has taken its pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CameraClock {
    /// Its own, where it tells and can be right.
    Camera,
    /// That of this machine when they come.
    Arrival,
}

/// What happens when a stage is slower than its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// As fast as frames are taken, and nothing is dropped: senders wait for their receivers.
    #[default]
    Lossless,
    /// The same at the frame rate of the footage.
    Paced,
    /// At the frame rate, and the latest message wins: what was not read in time is dropped and counted.
    Realtime,
}

impl Mode {
    /// Whether senders wait for their receivers.
    pub fn is_lossless(self) -> bool {
        self != Self::Realtime
    }

    /// How fast recorded frames are handed out.
    pub fn pace(self) -> Pace {
        match self {
            Self::Lossless => Pace::Fast,
            Self::Paced | Self::Realtime => Pace::Realtime,
        }
    }
}

/// How fast recorded frames are handed out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As fast as they can be read and taken.
    Fast,
    /// At the frame rate of the footage.
    Realtime,
}

/// How pixels get into the pipeline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Capture")]
pub struct Config {
    /// `lossless`, nothing is dropped; `paced`, the same at the frame rate; `realtime`, the latest frame wins, as always with a live camera.
    pub mode: Mode,
    /// Size of the frames that the pipeline sees, `[width, height]` pixels, in place of `scale`.
    pub size: Option<[usize; 2]>,
    /// Size of the frames as a share of the camera's image; without it, and without `size`, so that people are about 200 pixels high.
    pub scale: Option<f64>,
    /// Turn frames until the world's up points up.
    pub upright: bool,
    /// Frames per second of images, of a video that does not tell, and of live cameras together.
    pub frame_rate_hz: Option<f64>,
    /// First frame to use, from 0.
    pub start_frame: u64,
    /// Use every n-th frame.
    pub frame_step: u64,
    /// Most frames to use; without it all, and of live cameras until the run is stopped.
    pub n_frames: Option<u64>,
    /// Repetitions of a picture, bit for bit, from which on its camera counts as frozen; 0: never.
    pub frozen_after: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            mode: Mode::Lossless,
            size: None,
            scale: None,
            upright: true,
            frame_rate_hz: None,
            start_frame: 0,
            frame_step: 1,
            n_frames: None,
            frozen_after: 10,
        }
    }
}
