//! Section `[capture]` of a deployment file, and its `[[camera]]` entries.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::fault::{Fault, FaultError, FaultKind, Faults};

/// Source of one camera's pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name of the camera in the rig.
    pub name: String,
    /// Source of the pictures: a video, an image, a folder or pattern of images, a camera (`/dev/video0`, `rtsp://...`), a scene
    /// (`synth://...`), or a camera of a recording (`run.mcap#left`).
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// Keypoints from another program, instead of footage or in addition to it: a folder with one JSON file per frame, or a single JSON
    /// file.
    pub keypoints: Option<PathBuf>,
    /// Names of the keypoints: `coco-17`, `halpe-26`, `body-25`, `body-25b`, `openpose-18`, `mpii-16`, `lsp-14`, `coco-wholebody-133`,
    /// `halpe-136` or `body-135`; by default, the names in the file or, without such names, those that match the number of keypoints.
    pub keypoint_names: Option<String>,
    /// Network for this camera, instead of `network.file`.
    pub network: Option<PathBuf>,
    /// Position of the source's top-left pixel in the calibrated image, `[x, y]` in pixels, for a cropped source.
    pub source_offset_px: Option<[u32; 2]>,
    /// Clockwise rotation of the pictures in degrees (`0`, `90`, `180`, `270`), or `"tag"` to use the rotation stored in the file; by
    /// default, chosen to match the calibration.
    pub rotate: Option<Rotate>,
    /// For numbered pictures: the number of frame 0, and the step between frames; by default, from the numbers of all cameras.
    pub numbers: Option<[u64; 2]>,
    /// Time to add to the times of the footage, in milliseconds, so that all cameras share one clock (`parallax sync estimate`).
    pub offset_ms: Option<f64>,
    /// Deviation of the camera's clock, in parts per million; positive if its seconds are too long (`parallax sync estimate`).
    pub drift_ppm: Option<f64>,
    /// Pixel format of a video device, such as `MJPG` or `YUYV`; by default, the first supported one.
    pub format: Option<String>,
    /// Picture size of a live camera, `[width, height]` in pixels; by default, the camera's current setting.
    pub size: Option<[u32; 2]>,
    /// Frame rate of a live camera, in pictures per second; by default, the camera's current setting.
    pub frame_rate_hz: Option<f64>,
    /// Controls of a video device to set before the run, with the names that `parallax cameras` lists.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controls: BTreeMap<String, i64>,
    /// Transport protocol of an RTSP camera; by default, camera and reader negotiate it.
    pub transport: Option<Transport>,
    /// Clock that gives the times of an RTSP camera's pictures: the camera's own (`camera`, the default), or this machine's when they
    /// arrive (`arrival`).
    pub clock: Option<CameraClock>,
    /// Time from the instant of a frame to its picture in the footage, in milliseconds; negative if the picture is earlier.
    pub skew_ms: Option<f64>,
    /// Simulated fault for a test, such as `freeze@30+20`.
    #[serde(default, skip_serializing_if = "Faults::is_empty")]
    #[schemars(with = "String")]
    pub fault: Faults,
}

/// Rotation of the footage's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a rotation to the right of 0, 90, 180 or 270 degrees, or \"tag\""
)]
pub enum Rotate {
    /// Clockwise rotation, in degrees.
    Degrees(u16),
    /// Rotation stored in the file.
    Tag(Tag),
}

/// The value `tag`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Tag {
    /// Rotation stored in the file.
    Tag,
}

/// Transport protocol of an RTSP camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Transport {
    /// No packet is lost, but a late packet delays the packets after it.
    Tcp,
    /// Late packets are lost.
    Udp,
}

/// Clock that gives the times of an RTSP camera's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CameraClock {
    /// The camera's own clock, if the camera reports it and it is plausible.
    Camera,
    /// This machine's clock when the picture arrives.
    Arrival,
}

/// Behaviour of a stage that is slower than its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Frames are read as fast as they are processed. Nothing is dropped: senders wait for their receivers.
    #[default]
    Lossless,
    /// Like `Lossless`, but no faster than the frame rate of the footage.
    Paced,
    /// Frames are read at the frame rate, and the latest message wins: messages not read in time are dropped and counted.
    Realtime,
}

impl Mode {
    /// Returns true if senders wait for their receivers.
    pub fn is_lossless(self) -> bool {
        self != Self::Realtime
    }

    /// Returns the pace at which recorded frames are published.
    pub fn pace(self) -> Pace {
        match self {
            Self::Lossless => Pace::Fast,
            Self::Paced | Self::Realtime => Pace::Realtime,
        }
    }
}

/// Pace at which recorded frames are published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As fast as they can be read and processed.
    Fast,
    /// At the frame rate of the footage.
    Realtime,
}

/// How pixels enter the pipeline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Capture")]
pub struct Config {
    /// Behaviour of a stage that is too slow: `lossless` drops nothing; `paced` drops nothing either, but reads footage at its frame rate;
    /// `realtime` keeps only the latest frame (always used with live cameras).
    pub mode: Mode,
    /// Size of the frames in the pipeline, `[width, height]` in pixels, instead of `scale`.
    pub size: Option<[usize; 2]>,
    /// Size of the frames relative to the camera's image; if neither `scale` nor `size` is set, frames are scaled so that people are about
    /// 200 pixels high.
    pub scale: Option<f64>,
    /// Rotate frames so that the world's up direction points up.
    pub upright: bool,
    /// Frames per second of images, of a video without a rate, and of all live cameras together.
    pub frame_rate_hz: Option<f64>,
    /// First frame to use, counted from 0.
    pub start_frame: u64,
    /// Use every n-th frame.
    pub frame_step: u64,
    /// Maximum number of frames to use; by default, all frames of the footage, or no limit with live cameras.
    pub n_frames: Option<u64>,
    /// Number of identical repetitions of a picture after which a camera counts as frozen; 0 means never.
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
