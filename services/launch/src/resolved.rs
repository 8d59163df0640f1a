//! A resolved deployment: a deployment with the metadata of its footage. Every process gets it as input.

use core::time::Duration;
use std::io::{IsTerminal as _, Read as _};
use std::path::Path;

use deployment::hosts::Host;
use deployment::{Deployment, RecordingPlan, Replay, Topology};
use failure::{ExitKind, Failure, OrFail as _};
use runtime::Delivery;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::cameras::Footage;
use crate::search_size::SearchSize;

/// A deployment with the metadata of its footage. Every process gets it as input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// The deployment, with absolute paths.
    pub deployment: Deployment,
    /// The footage of every camera.
    pub footage: Vec<Footage>,
    /// The sizes of the frames, if the deployment sets none.
    pub search_size: Option<SearchSize>,
    /// Names of the keypoints, other than the joints, that the networks and keypoint files of the cameras have. Each name occurs once.
    pub extra_keypoints: Vec<String>,
    /// True if a network names left and right as seen in the picture. All views together then decide which side is the person's left.
    pub sides_as_seen: bool,
    /// The host that runs here, in a deployment of several hosts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host: Option<String>,
    /// The recording to write, if there is one.
    pub recording: Option<RecordingPlan>,
    /// The recording that replaces the first stages, if there is one.
    pub replay: Option<Replay>,
}

/// Key of the output of `ffprobe`, which is stored beside the fields of [`Resolved`].
const ANSWERS: &str = "ffprobe";

/// The services, in pipeline order.
pub const SERVICES: [&str; 6] = [
    "capture",
    "pose",
    "quality",
    "fuse",
    "triangulate",
    "results",
];

impl Resolved {
    /// Returns the number of frames to use, which is the number of frames of the longest footage.
    pub fn n_frames(&self) -> u64 {
        self.footage.iter().map(|footage| footage.n_frames).max().unwrap_or(0)
    }

    /// Returns true if the deployment runs until it is stopped: it has a live camera, and no number of frames is set.
    pub fn is_endless(&self) -> bool {
        self.deployment.capture.n_frames.is_none() && self.has_live()
    }

    /// Returns true if the deployment has a live camera.
    pub fn has_live(&self) -> bool {
        let mut cameras = self.deployment.cameras.iter();
        cameras.any(|camera| crate::cameras::is_live(&camera.source))
    }

    /// Returns the views with a live camera.
    pub fn live_views(&self) -> Vec<usize> {
        let cameras = self.deployment.cameras.iter().enumerate();
        let live = cameras.filter(|camera| crate::cameras::is_live(&camera.1.source));
        live.map(|view| view.0).collect()
    }

    /// Returns the frame rate of a run with live cameras, per second, before `frame_step` is applied. The deployment sets it; otherwise it
    /// is the rate of the slowest camera.
    pub fn instants_hz(&self) -> f64 {
        let step = self.deployment.capture.frame_step as f64;
        let own = self.footage.iter().filter_map(|footage| footage.frame_rate_hz);
        let slowest = own.fold(f64::INFINITY, f64::min) * step;
        self.deployment.capture.frame_rate_hz.unwrap_or(slowest)
    }

    /// Returns the frame rate of the footage, per second, before `frame_step` is applied; `None` if it is not known.
    pub fn frame_rate_hz(&self) -> Option<f64> {
        let capture = &self.deployment.capture;
        let step = capture.frame_step as f64;
        if self.has_live() {
            return Some(self.instants_hz());
        }
        let known = self.footage.iter().filter_map(|footage| footage.frame_rate_hz);
        let all: Vec<f64> = known.map(|value| value * step).collect();
        // If the files contradict each other, the setting of the deployment is used.
        let agree = all.iter().all(|value| (value / all[0] - 1.0).abs() < 1e-3);
        let given = capture.frame_rate_hz.filter(|_| !agree);
        given.or_else(|| all.first().copied())
    }

    /// Writes the deployment to a file for the user, without passwords of cameras.
    pub(crate) fn write(&self, file: &Path) -> Result<(), Failure> {
        files::replace(
            file,
            footage::without_passwords(&self.to_text()?).as_bytes(),
        )
        .map_err(|error| failure::in_file(file, &error))
    }

    /// Returns the text that every process gets on standard input. It includes the properties of the footage, so that they need not be
    /// determined again.
    pub(crate) fn to_text(&self) -> Result<String, Failure> {
        let mut value = serde_json::to_value(self).or_fail(ExitKind::Run)?;
        value[ANSWERS] = footage::answers_so_far();
        serde_json::to_string_pretty(&value).or_fail(ExitKind::Run)
    }

    /// Reads the resolved deployment from standard input, to which the supervisor writes it. The file in the output
    /// folder could have been removed, or replaced by another run, before a restart.
    ///
    /// * `file`: a file with the same content. It is read if standard input is empty or a terminal, as for a
    ///   process that is started by hand.
    ///
    /// # Errors
    ///
    /// Fails if neither standard input nor the file can be read, or the text is not a resolved deployment.
    pub fn read(file: &Path) -> Result<Self, Failure> {
        let wrong = |error: &dyn core::error::Error| failure::in_file(file, error);
        let mut text = String::new();
        if !std::io::stdin().is_terminal() {
            let read = std::io::stdin().read_to_string(&mut text);
            read.map_err(|error| wrong(&error))?;
        }
        if text.is_empty() {
            text = failure::read_text(file)?;
        }
        let value: Value = serde_json::from_str(&text).map_err(|error| wrong(&error))?;
        footage::remember_answers(&value[ANSWERS]);
        serde_json::from_value(value).map_err(|error| wrong(&error))
    }

    /// Returns how messages are delivered to receivers that are slower than their senders.
    pub fn delivery(&self) -> Delivery {
        if self.deployment.capture.mode.is_lossless() {
            Delivery::Lossless
        } else {
            Delivery::Realtime
        }
    }

    /// Returns how long a stage waits for a late view.
    pub fn patience(&self) -> Duration {
        Duration::from_millis(self.deployment.deadline_ms())
    }

    /// Returns the processes of the deployment and the topics between them.
    pub fn topology(&self) -> Topology {
        let (recording, replay) = (self.recording.as_ref(), self.replay.as_ref());
        let whole = Topology::new(&self.deployment, recording, replay);
        match self.own_host() {
            Some(host) => whole.on_host(&self.deployment, host),
            None => whole,
        }
    }

    /// Returns the host that runs here, in a deployment of several hosts.
    pub fn own_host(&self) -> Option<&Host> {
        self.deployment.host(self.host.as_deref()?)
    }

    /// Returns true if this host only has cameras, and another host computes the results.
    pub fn is_far(&self) -> bool {
        self.own_host().is_some_and(|own_host| !own_host.fuses)
    }
}
