//! The settings of the process.

use core::time::Duration;

use footage::SourceSpec;
use geometry::Framing;

use crate::live::LiveJob;
use deployment::Timeline;
use deployment::capture::{Faults, Mode, Pace};

/// The settings of the process of one camera.
#[derive(Debug)]
pub struct Job {
    /// Index of the view.
    pub view: usize,
    /// Footage of the camera.
    pub source: SourceSpec,
    /// For cameras with clocks of their own: the frame that belongs to each common instant (a time at which all cameras should take a
    /// picture). `source` then counts these instants.
    pub timeline: Option<Timeline>,
    /// Settings of the camera if it is live. In this case, only the choice of frames in `source` is used.
    pub live: Option<LiveJob>,
    /// Time from the beginning of the run to the first frame in real time, in nanoseconds. It is long enough for every process to start.
    pub lead_nanos: u64,
    /// Faults to simulate.
    pub faults: Faults,
    /// Number of repetitions from which a picture counts as frozen; 0 to disable the check.
    pub frozen_after: u32,
    /// Time from the nominal time of a frame until its picture was taken, in nanoseconds. It is measured if the camera is live.
    pub skew_nanos: i64,
    /// Mapping from the footage to the frames of the pipeline.
    pub framing: Framing,
    /// Mode, which decides whether frames may be dropped.
    pub mode: Mode,
    /// Speed at which frames are sent.
    pub pace: Pace,
    /// Number of processes that receive the frames.
    pub n_consumers: usize,
    /// Time that the process waits for its receivers.
    pub patience: Duration,
}
