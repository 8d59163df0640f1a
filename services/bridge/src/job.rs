//! The settings of the process.

use core::time::Duration;
use std::path::PathBuf;

use crate::hosts::{Fingerprint, Grid};
use deployment::hosts::Carry;

use crate::address::Address;
use crate::maps::ViewMaps;

/// The settings of the process.
#[derive(Debug)]
pub struct Job {
    /// Address to connect to or to listen on, with the names and keys of the hosts.
    pub address: Address,
    /// Fingerprint of the files and settings that must be the same on all hosts.
    pub fingerprint: Fingerprint,
    /// Kind of messages that are sent between the hosts.
    pub carry: Carry,
    /// True if expected errors are sent with poses.
    pub has_quality: bool,
    /// Properties of the maps, by view, if maps are sent with the poses; otherwise empty.
    pub maps: Vec<ViewMaps>,
    /// Width and height of the frames of every view of the deployment, in pixels.
    pub sizes: Vec<[u32; 2]>,
    /// Time from the start of the session to the nominal time of the first frame, in nanoseconds.
    pub lead_nanos: u64,
    /// Interval between the nominal times of consecutive frames, in nanoseconds.
    pub period_nanos: f64,
    /// The first frame of the footage.
    pub start_frame: u64,
    /// Interval between used frames, in frames of the footage.
    pub frame_step: u64,
    /// Role of this host.
    pub role: Role,
}

/// Role of a host.
#[derive(Debug)]
pub enum Role {
    /// The host has cameras, and sends messages.
    Far(Far),
    /// The host fuses, and receives messages.
    Near(Near),
}

/// A host with cameras.
#[derive(Debug)]
pub struct Far {
    /// Views of the host.
    pub views: Vec<usize>,
    /// Quality of the JPEG, 1 to 100.
    pub jpeg_quality: u8,
}

/// The fusing host.
#[derive(Debug)]
pub struct Near {
    /// The other hosts.
    pub hosts: Vec<NearHost>,
    /// Number of frames of the run.
    pub n_frames: u64,
    /// Number of processes that receive the messages of each view.
    pub n_receivers: Vec<usize>,
    /// Time that the process waits for its receivers.
    pub patience: Duration,
    /// Uncertainty of another host's clock above which a warning is logged, as a fraction of the frame period.
    pub max_clock_share: f64,
    /// File to which the state of the hosts is written: `hosts.json`.
    pub file: PathBuf,
}

/// A host with cameras, as known to the fusing host.
#[derive(Debug, Clone)]
pub struct NearHost {
    /// Name of the host.
    pub name: String,
    /// Views of the host.
    pub views: Vec<usize>,
}

impl Job {
    /// Returns the times of the frames of this host's run.
    pub(crate) fn grid(&self, session: u64) -> Grid {
        Grid {
            start_nanos: session.saturating_add(self.lead_nanos),
            period_nanos: self.period_nanos,
        }
    }

    /// Returns the index, among the frame times of the run, of a frame of the footage.
    pub(crate) fn nth(&self, frame: u64) -> u64 {
        frame.saturating_sub(self.start_frame) / self.frame_step.max(1)
    }

    /// Returns the frame of the footage that belongs to a frame time with this index.
    pub(crate) fn frame(&self, nth: u64) -> u64 {
        self.start_frame.saturating_add(nth.saturating_mul(self.frame_step))
    }
}
