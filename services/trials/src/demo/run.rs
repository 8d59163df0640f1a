//! What is known of a run of the demo that is over.

use launch::Report;

use super::machine::Machine;
use crate::trial::Point;
use crate::trial::results::Moment;
use crate::trial::strike::Times;

/// The camera that is killed, from 0.
pub(super) const VICTIM: usize = 2;

/// A run that is over, and all that is known of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    /// Names, in the order of the rig.
    pub cameras: &'a [String],
    /// Frames of every camera.
    pub n_frames: u64,
    /// And how many a second.
    pub rate_hz: f64,
    /// How long a stage waits for a view that is late, milliseconds.
    pub deadline_ms: f64,
    /// What was measured of the machine, before the run or after it, whichever is slower.
    pub machine: Option<Machine>,
    /// Names of all processes but the supervisor.
    pub processes: &'a [String],
    /// What `run` says of it.
    pub ran: &'a Report,
    /// The results.
    pub moments: &'a [Moment],
    /// Where the joints were, for each of them.
    pub truth: &'a [Vec<Point>],
    /// What became of the camera that was to be killed, if one was.
    pub killed: Option<Times>,
    /// When the run was planned, `runtime::now_nanos`.
    pub session: u64,
}
