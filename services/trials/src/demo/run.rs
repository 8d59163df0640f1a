//! A completed run of the demo.

use launch::Report;

use super::machine::Machine;
use crate::trial::Point;
use crate::trial::injection::FaultTimes;
use crate::trial::results::FrameResult;

/// Number of the view whose camera is killed.
pub(super) const VICTIM: usize = 2;

/// A completed run of the demo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    /// The names of the cameras, in the order of the rig.
    pub cameras: &'a [String],
    /// Frames per camera.
    pub n_frames: u64,
    /// Frames per second.
    pub rate_hz: f64,
    /// Time that a stage waits for a late view, in milliseconds.
    pub deadline_ms: f64,
    /// Speed of this machine: the slower of the measurements before and after the run.
    pub machine: Option<Machine>,
    /// The names of all processes except the supervisor.
    pub processes: &'a [String],
    /// The report of `launch` on the run.
    pub report: &'a Report,
    /// Results of the run.
    pub results: &'a [FrameResult],
    /// The true joints of each person in each result in world coordinates, in metres.
    pub truth: &'a [Vec<Vec<Point>>],
    /// Times of the kill; `None` if no kill was planned.
    pub killed: Option<FaultTimes>,
    /// The session, which is the time of planning (`failure::now_nanos`).
    pub session: u64,
}
