//! Section `[pose]` of a deployment file.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::SHIPPED;

/// The single-view solver, and what it hands on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Pose")]
pub struct Config {
    /// Levels either side of every candidate's that fusion may use, or `"all"`.
    pub evidence_window: Window,
    /// Most distinct candidates that a view offers to fusion.
    pub candidates: usize,
    /// Least mean distance of two candidates' parts, in box sides.
    pub min_separation: f64,
    /// What tells from the picture in which direction a person faces, for left and right: a file that
    /// `parallax-lab train orientation` made; `"shipped"`: the one that ships; `"none"`: nothing.
    pub orientation: PathBuf,
    /// An ONNX file of a network that finds keypoints, which takes the place of the filters; `"shipped"`: the one that ships;
    /// `"none"`: the filters. Without it the one that ships, unless `model` names filters, or a camera has a network or keypoints. Settings
    /// that only the filters or the paper's energy have (`quality`, `pose.search`, `pose.orientation`,
    /// `triangulate.joint_map`, `triangulate.combine`, `fuse.views`, `fuse.energy`, `fuse.pairs`, `fuse.workers`, `fuse.consistency`,
    /// `fuse.compatibility`) are refused where nothing says that the filters find people.
    pub network: Option<PathBuf>,
    /// The card that describes the network; without it the file beside it (`.toml` for `.onnx`), or what its metadata say.
    pub network_card: Option<PathBuf>,
    /// `network`: an ONNX file of a detector of people, which says where the network looks; without it the filters do.
    pub detector: Option<PathBuf>,
    /// The card that describes the detector; without it the file beside it (`.toml` for `.onnx`), or what its metadata say.
    pub detector_card: Option<PathBuf>,
    /// `network`: what holds its maps together: a file that `parallax-lab train springs` made; `"shipped"`: the one that ships.
    pub springs: PathBuf,
    /// `network`: people are looked for in every n-th frame, and wherever nobody is seen; between, the network looks where they were.
    /// Without it twice a second with a `detector`, once by the filters, which take longer, and at most in every tenth; in every frame
    /// if these are more than 0.4 s apart or their rate is not known. With realtime delivery searches then take at most an eighth of the time of
    /// a view that sees somebody.
    pub find_every: Option<u64>,
    /// `network`, keypoints: least mean heat (or confidence) of the joints of somebody who is seen, 0 to 1. In space, seven joints of a
    /// person need twice as much in two views.
    pub least_heat: f64,
    /// Standard deviation of keypoints that another program found (`keypoints` of a `[[camera]]`), share of the height of the person's
    /// box enlarged by a quarter.
    pub keypoint_sigma: f64,
    /// `network`: most people of a view that it looks at.
    pub people: usize,
    /// `network`: whether it looks at the mirror image of every person as well, and the mean of both counts. That is more exact,
    /// and takes its time twice; not for networks that give positions in place of maps.
    pub mirror: bool,
    /// `network`: the library of ONNX Runtime (`libonnxruntime.so`) that runs it and the detector; without it `rten`, which is built in.
    pub onnx_runtime: Option<PathBuf>,
    /// Threads of one pose process.
    pub threads: usize,
    /// `full`: every frame everywhere; `tracked`: near the last pose, faster and approximate.
    pub search: Search,
    /// `tracked`: levels either side of the last pose's that are searched.
    pub tracked_levels: u16,
    /// `tracked`: how far around the last pose's box is searched, as a share of its longer side.
    pub tracked_margin: f64,
    /// `tracked`: every n-th frame is searched in full.
    pub tracked_full_every: u64,
    /// `tracked`: largest step from frame to frame that is followed; 1: no frame may be left out.
    pub tracked_max_gap: u64,
    /// `tracked`: fall of the score since the last full search that asks for another, of the same frame.
    pub tracked_max_drop: f32,
    /// `tracked`: how far a pose may move in a second, as a share of its box's longer side.
    pub tracked_speed: f64,
    /// `tracked`: longest time from frame to frame that is followed; longer ones are searched in full.
    pub tracked_max_gap_ms: f64,
    /// `tracked`: a frame so long after the last full search is searched in full.
    pub tracked_full_every_ms: f64,
}

/// How a pose process looks for poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Search {
    /// Every frame on all levels and everywhere: the paper's method.
    #[default]
    Full,
    /// Near the best pose of the last frame, and in full now and then: faster, and approximate.
    Tracked,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            evidence_window: Window::All(All::All),
            candidates: 8,
            min_separation: 1.0,
            orientation: PathBuf::from(SHIPPED),
            network: None,
            network_card: None,
            detector: None,
            detector_card: None,
            springs: PathBuf::from(SHIPPED),
            find_every: None,
            least_heat: 0.2,
            keypoint_sigma: 0.02,
            people: 3,
            mirror: false,
            onnx_runtime: None,
            threads: 1,
            search: Search::Full,
            tracked_levels: 4,
            tracked_margin: 0.25,
            tracked_full_every: 10,
            tracked_max_gap: 2,
            tracked_max_drop: 0.3,
            tracked_speed: 2.0,
            tracked_max_gap_ms: 250.0,
            tracked_full_every_ms: 500.0,
        }
    }
}

/// Levels of the pyramid around those of the candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number of levels, or \"all\"")]
pub enum Window {
    /// So many levels either side of every candidate's own.
    Levels(u16),
    /// All of them.
    All(All),
}

/// The word `all`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum All {
    /// Everything.
    All,
}
