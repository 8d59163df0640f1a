//! A deployment whose footage is known: what every process is given.

use core::time::Duration;
use std::io::{IsTerminal as _, Read as _};
use std::path::Path;

use deployment::{Deployment, RecordingPlan, Replay, Topology};
use runtime::{Delivery, ExitKind, Failure, OrFail as _};
use serde::{Deserialize, Serialize};

use crate::inputs::Footage;

/// A deployment with what was found out about its footage: what every process is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// The deployment, all paths absolute.
    pub deployment: Deployment,
    /// The footage of every camera.
    pub footage: Vec<Footage>,
    /// The file that every message goes to, if there is one.
    #[serde(default, alias = "tape")]
    pub recording: Option<RecordingPlan>,
    /// The recording that stands in for the first stages, if there is one.
    #[serde(default)]
    pub replay: Option<Replay>,
}

/// The services, in the order in which a frame passes them.
pub const SERVICES: [&str; 6] = [
    "capture",
    "pose",
    "quality",
    "fuse",
    "triangulate",
    "results",
];

impl Resolved {
    /// Frames that will be used.
    pub fn n_frames(&self) -> u64 {
        self.footage.iter().map(|it| it.n_frames).max().unwrap_or(0)
    }

    /// Frames of the footage per second, where any camera knows.
    pub fn frame_rate_hz(&self) -> Option<f64> {
        let capture = &self.deployment.capture;
        let step = capture.frame_step as f64;
        let known = self.footage.iter().filter_map(|it| it.frame_rate_hz);
        let all: Vec<f64> = known.map(|it| it * step).collect();
        // Files that contradict each other are overruled by who knows better.
        let agree = all.iter().all(|it| (it / all[0] - 1.0).abs() < 1e-3);
        let given = capture.frame_rate_hz.filter(|_| !agree);
        given.or_else(|| all.first().copied())
    }

    /// Writes it for the user to read.
    pub(crate) fn write(&self, file: &Path) -> Result<(), Failure> {
        std::fs::write(file, self.to_text()?).map_err(|error| runtime::in_file(file, &error))
    }

    /// What every process is given.
    pub(crate) fn to_text(&self) -> Result<String, Failure> {
        serde_json::to_string_pretty(self).or_fail(ExitKind::Run)
    }

    /// Reads what the supervisor has given to this process, in its standard input: the file in the output folder may
    /// be gone or be another run's when a process is started again.
    ///
    /// * `file`: the file of the same content; it is read by a process that was started by hand, without anything in
    ///   its input.
    ///
    /// # Errors
    ///
    /// Neither input nor file hold it, or what they hold is something else.
    pub fn given(file: &Path) -> Result<Self, Failure> {
        let wrong = |error: &dyn core::error::Error| runtime::in_file(file, error);
        let mut text = String::new();
        if !std::io::stdin().is_terminal() {
            let read = std::io::stdin().read_to_string(&mut text);
            read.map_err(|error| wrong(&error))?;
        }
        if text.is_empty() {
            text = runtime::read_text(file)?;
        }
        serde_json::from_str(&text).map_err(|error| wrong(&error))
    }

    /// What happens when a receiver is slower than its sender.
    pub fn delivery(&self) -> Delivery {
        match self.deployment.capture.mode {
            deployment::capture::Mode::Lossless => Delivery::Lossless,
            deployment::capture::Mode::Realtime => Delivery::Realtime,
        }
    }

    /// How long a stage waits for a view that is late.
    pub fn patience(&self) -> Duration {
        Duration::from_millis(self.deployment.deadline_ms())
    }

    /// The processes of the deployment, and who sends to whom.
    pub fn topology(&self) -> Topology {
        let (recording, replay) = (self.recording.as_ref(), self.replay.as_ref());
        Topology::new(&self.deployment, recording, replay)
    }
}
