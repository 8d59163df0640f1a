//! Task of the process.

use core::time::Duration;
use std::path::PathBuf;

use crate::hosts::{Fingerprint, Grid};
use deployment::hosts::Carry;

use crate::address::Address;
use crate::maps::ViewMaps;

/// Task of the process.
#[derive(Debug)]
pub struct Job {
    /// Where it connects to, or listens, and as whom.
    pub address: Address,
    /// Fingerprint of the files and settings that must be the same on all hosts.
    pub fingerprint: Fingerprint,
    /// Kind of messages sent between the hosts.
    pub carry: Carry,
    /// True if expected errors are sent with poses.
    pub has_quality: bool,
    /// By view, where the maps of the views cross with their poses; else empty.
    pub maps: Vec<ViewMaps>,
    /// Width and height of the frames of every view of the deployment, pixels.
    pub sizes: Vec<[u32; 2]>,
    /// From the session to the first instant, nanoseconds.
    pub lead_nanos: u64,
    /// From one instant to the next, nanoseconds.
    pub period_nanos: f64,
    /// The first frame of the footage.
    pub start_frame: u64,
    /// From one frame to the next.
    pub frame_step: u64,
    /// The part of this host.
    pub role: Role,
}

/// The part of a host.
#[derive(Debug)]
pub enum Role {
    /// It has cameras, and sends.
    Far(Far),
    /// It fuses, and receives.
    Near(Near),
}

/// A host with cameras.
#[derive(Debug)]
pub struct Far {
    /// Its views.
    pub views: Vec<usize>,
    /// Quality of the JPEG, 1 to 100.
    pub jpeg_quality: u8,
}

/// The host that fuses.
#[derive(Debug)]
pub struct Near {
    /// The others.
    pub hosts: Vec<NearHost>,
    /// Frames of the run.
    pub n_frames: u64,
    /// Processes that receive what is published about a view, by view.
    pub n_receivers: Vec<usize>,
    /// How long the process waits for them.
    pub patience: Duration,
    /// Largest uncertainty of another host's clock without a warning, as a share of the period.
    pub max_clock_share: f64,
    /// Where the state of the hosts is written: `hosts.json`.
    pub file: PathBuf,
}

/// A host with cameras, as the one that fuses knows it.
#[derive(Debug, Clone)]
pub struct NearHost {
    /// Its name.
    pub name: String,
    /// Its views.
    pub views: Vec<usize>,
}

impl Job {
    /// The instants of the run of this host.
    pub(crate) fn grid(&self, session: u64) -> Grid {
        Grid {
            start_nanos: session.saturating_add(self.lead_nanos),
            period_nanos: self.period_nanos,
        }
    }

    /// The number of a frame of the footage among the instants.
    pub(crate) fn nth(&self, frame: u64) -> u64 {
        frame.saturating_sub(self.start_frame) / self.frame_step.max(1)
    }

    /// The frame of the footage at an instant.
    pub(crate) fn frame(&self, nth: u64) -> u64 {
        self.start_frame.saturating_add(nth.saturating_mul(self.frame_step))
    }
}
