//! Task of the process.

use core::time::Duration;

use footage::SourceSpec;
use geometry::Framing;

use crate::live::LiveJob;
use deployment::Timeline;
use deployment::capture::{Faults, Mode, Pace};

/// Task of the process of one camera.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// The footage.
    pub source: SourceSpec,
    /// Which frame belongs to each common instant, where cameras have clocks of their own; `source` counts instants then.
    pub timeline: Option<Timeline>,
    /// The live camera, if it is one; of `source` only the choice of frames counts then.
    pub live: Option<LiveJob>,
    /// From the beginning of the run to the first frame in real time, nanoseconds, so that every process has started.
    pub lead_nanos: u64,
    /// Faults that are simulated.
    pub faults: Faults,
    /// Repetitions from which on a picture counts as frozen; 0 for never.
    pub frozen_after: u32,
    /// How long after the instants of their frames the pictures of footage were taken, nanoseconds; that of a live camera is
    /// measured.
    pub skew_nanos: i64,
    /// From the footage to the frames of the pipeline.
    pub framing: Framing,
    /// Mode: decides whether frames may be dropped.
    pub mode: Mode,
    /// How fast frames are sent.
    pub pace: Pace,
    /// Processes that receive the frames.
    pub n_consumers: usize,
    /// How long the process waits for them.
    pub patience: Duration,
}
