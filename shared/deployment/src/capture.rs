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
    /// Name of the camera in the rig.
    pub name: String,
    /// A video, an image, a folder or pattern of images, a camera (`/dev/video0`, `rtsp://...`), a scene (`synth://...`), or a camera of a recording
    /// (`run.mcap#left`).
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// Keypoints from another program, in place of footage or beside it: a folder with a JSON file for every frame, or one JSON file.
    pub keypoints: Option<PathBuf>,
    /// Names of the keypoints: `coco-17`, `halpe-26`, `body-25`, `body-25b`, `openpose-18`, `mpii-16`, `lsp-14`, `coco-wholebody-133`, `halpe-136` or
    /// `body-135`; by default by their number, or as the file says.
    pub keypoint_names: Option<String>,
    /// Network of this camera, in place of `network.file`.
    pub network: Option<PathBuf>,
    /// Place of the source's top-left pixel in the calibrated image, `[x, y]` pixels, for a cropped source.
    pub source_offset_px: Option<[u32; 2]>,
    /// Clockwise turn of the pictures, degrees (`0`, `90`, `180`, `270`), or `"tag"`, as the file says; by default to match the calibration.
    pub rotate: Option<Rotate>,
    /// Numbered pictures: the number of frame 0, and the step from frame to frame; by default from the numbers of all cameras.
    pub numbers: Option<[u64; 2]>,
    /// Time to add to the times of the footage, milliseconds, so that all cameras share one clock (`parallax sync estimate`).
    pub offset_ms: Option<f64>,
    /// Excess length of a second of the camera's clock, millionths (`parallax sync estimate`).
    pub drift_ppm: Option<f64>,
    /// Format of a video device's pictures, such as `MJPG` or `YUYV`; by default the first supported one.
    pub format: Option<String>,
    /// Size of a live camera's pictures, `[width, height]` pixels; by default as the camera is set.
    pub size: Option<[u32; 2]>,
    /// Pictures per second of a live camera; by default as the camera is set.
    pub frame_rate_hz: Option<f64>,
    /// Controls of a video device to set before the run, by the names that `parallax cameras` lists.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controls: BTreeMap<String, i64>,
    /// Transport of the packets of an RTSP camera; by default as camera and reader agree.
    pub transport: Option<Transport>,
    /// Clock for the times of an RTSP camera's pictures: its own (`camera`, the default), or this machine's at their `arrival`.
    pub clock: Option<CameraClock>,
    /// Time from the instants of the frames to the pictures of the footage, milliseconds, negative for earlier pictures.
    pub skew_ms: Option<f64>,
    /// Fault on purpose, for a test, such as `freeze@30+20`.
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

/// Behaviour of a stage that is slower than its input.
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
    /// Returns true if senders wait for their receivers.
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
    /// `lossless`, nothing is dropped; `paced`, the same at the frame rate; `realtime`, the latest frame wins (always with live cameras).
    pub mode: Mode,
    /// Size of the frames in the pipeline, `[width, height]` pixels, in place of `scale`.
    pub size: Option<[usize; 2]>,
    /// Size of the frames as a share of the camera's image; without it and `size`, people become about 200 pixels high.
    pub scale: Option<f64>,
    /// Turn frames until the world's up points up.
    pub upright: bool,
    /// Frames per second of images, of a video without a rate, and of live cameras together.
    pub frame_rate_hz: Option<f64>,
    /// First frame to use, from 0.
    pub start_frame: u64,
    /// Use every n-th frame.
    pub frame_step: u64,
    /// Most frames to use; by default all, or with live cameras until the run is stopped.
    pub n_frames: Option<u64>,
    /// Number of repetitions of a picture, bit for bit, after which a camera counts as frozen; 0: never.
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
