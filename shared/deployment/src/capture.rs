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
    /// A video, an image, a folder of images, a glob such as `frames/*.png`, or a scene that is made while it
    /// runs: `synth://humaneva?camera=C1&action=walking&subject=3&seed=1`. Or a live camera: `/dev/video0`,
    /// `/dev/v4l/by-id/...`, `rtsp://...`, `udp://...`, `http://...`; or one of a recording: `run.mcap#left`. With `keypoints`
    /// it may be left out.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// Keypoints that another program found in the footage: a folder with a JSON file for every frame, in the layout of OpenPose
    /// or mmpose, or one JSON file in that of COCO or mmpose.
    pub keypoints: Option<PathBuf>,
    /// What these are called: `coco-17`, `halpe-26`, `body-25`, `body-25b`, `openpose-18`, `mpii-16` or `lsp-14`; of the whole body
    /// `coco-wholebody-133`, `halpe-136` or `body-135`, whose face and hands are not read; without it what their number tells, or the
    /// file itself.
    pub keypoint_names: Option<String>,
    /// A network of this camera's own, in the place of `pose.network`.
    pub network: Option<PathBuf>,
    /// The card of that network; without it as for `pose.network_card`.
    pub network_card: Option<PathBuf>,
    /// Where the source's top-left pixel lies on the calibrated image, `[x, y]` pixels, for a source
    /// that lacks rows or columns of it. Without it the sizes must be equal.
    pub source_offset_px: Option<[u32; 2]>,
    /// Footage: how its pictures are turned before they are used, degrees to the right, `0` (as they are stored), `90`, `180` or `270`; or
    /// `"tag"`, as the file asks (EXIF, display matrix). Without it as the calibration is: by the size of its pictures, else by where up is
    /// in them.
    pub rotate: Option<Rotate>,
    /// Numbered pictures: the number in the name of frame 0, and by how much numbers rise from frame to frame. Without it by the numbers
    /// of all cameras: one that is missing is a frame without a picture of that camera.
    pub numbers: Option<[u64; 2]>,
    /// Footage: what is added to its times to have those that all cameras have in common, milliseconds: a camera that was started
    /// 2 s after the reference has 2000. `parallax sync estimate` finds it. Frames are brought to common instants by it.
    pub offset_ms: Option<f64>,
    /// Footage: by how much a second of this camera's clock is too long, millionths, from its first frame on; `parallax sync estimate`
    /// finds it where the footage is long enough.
    pub drift_ppm: Option<f64>,
    /// Video devices: the format of their pictures, such as `MJPG` or `YUYV`; without it the first of these and of `UYVY`,
    /// `NV12`, `RGB3`, `BGR3`, `GREY` that the camera has.
    pub format: Option<String>,
    /// Live cameras: `[width, height]` of their pictures, pixels; without it as the camera is set.
    pub size: Option<[u32; 2]>,
    /// Live cameras: pictures per second; without it what the camera says.
    pub frame_rate_hz: Option<f64>,
    /// Video devices: what to set before the run, by the names that `parallax cameras` lists: `{ exposure_time_absolute = 100 }`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controls: BTreeMap<String, i64>,
    /// RTSP cameras: how packets travel, `tcp` or `udp`; without it as the camera and the reader agree.
    pub transport: Option<Transport>,
    /// RTSP cameras: when pictures were taken. `camera`: as the camera tells, where it does and its clock can be right; `arrival`: by when
    /// they come, less the shortest delay among them. Without it `camera`.
    pub clock: Option<CameraClock>,
    /// Footage: how long after the instants of the frames its pictures were taken, milliseconds, negative for before; without it 0, or
    /// what a `synth://` source says. Joints are moved to the instants by it, and by what `offset_ms` and `drift_ppm` leave after whole frames.
    /// For a live camera it is measured.
    pub skew_ms: Option<f64>,
    /// What is to go wrong with the camera, for a test: `freeze@30+20`.
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
    /// Nothing is dropped: senders wait for their receivers.
    #[default]
    Lossless,
    /// The latest message wins; what was not read in time is dropped and counted.
    Realtime,
}

/// How fast recorded frames are handed out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Pace {
    /// As fast as they can be read and taken.
    #[default]
    Fast,
    /// At the frame rate of the footage.
    Realtime,
}

/// How pixels get into the pipeline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Capture")]
pub struct Config {
    /// `lossless`: nothing is dropped; `realtime`: the latest frame wins. With a live camera always `realtime`.
    pub mode: Mode,
    /// `fast`: as fast as frames are taken; `realtime`: at the frame rate. With a live camera always `realtime`.
    pub pace: Pace,
    /// `[width, height]` of the frames that the pipeline sees, pixels; in place of `scale`.
    pub size: Option<[usize; 2]>,
    /// Size of the frames as a share of the camera's image; without `scale` and `size`: by itself, for every camera the one
    /// in which a standing person is about 200 pixels high where the cameras see together; `run --dry-run` shows it.
    pub scale: Option<f64>,
    /// Turn frames until the world's up points up.
    pub upright: bool,
    /// Frames per second of images, and of a video that does not tell; with live cameras how often all of them are
    /// brought together: without it as often as the slowest has a picture.
    pub frame_rate_hz: Option<f64>,
    /// First frame to use, from 0.
    pub start_frame: u64,
    /// Use every n-th frame.
    pub frame_step: u64,
    /// Most frames to use; all without it, and of live cameras until the run is stopped.
    pub n_frames: Option<u64>,
    /// How far the pictures of a live camera may be from the instants of the frames before a warning, milliseconds; without it half
    /// of the time from one instant to the next.
    pub max_skew_ms: Option<f64>,
    /// Repetitions of a picture, bit for bit, from which on its camera is called frozen; 0: never.
    pub frozen_after: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            mode: Mode::Lossless,
            pace: Pace::Fast,
            size: None,
            scale: None,
            upright: true,
            frame_rate_hz: None,
            start_frame: 0,
            frame_step: 1,
            n_frames: None,
            max_skew_ms: None,
            frozen_after: 10,
        }
    }
}
