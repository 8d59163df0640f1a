//! What is sent about one frame.

use client::{Moment, Skeleton};

/// What is sent about one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame<'a> {
    /// Name of the deployment.
    pub deployment: &'a str,
    /// The session.
    pub session: u64,
    /// Number of the frame.
    pub frame: u64,
    /// When it was captured, nanoseconds of `CLOCK_MONOTONIC`.
    pub captured_at_nanos: u64,
    /// "ok", or why there is no skeleton.
    pub status: &'a str,
    /// Whether left and right are decided.
    pub sides: &'a str,
    /// Number of people that several views agree on; 0 if it was not counted.
    pub n_people: u32,
    /// Frames that are missing before this one.
    pub n_missed: u64,
    /// The joints by name: a place, or why there is none. Empty without a skeleton.
    pub joints: Vec<(&'a str, Result<Place, &'a str>)>,
}

/// Where a joint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// World frame of the calibration, metres.
    pub in_world: [f64; 3],
    /// Standard deviation along one axis, metres.
    pub deviation_m: f64,
}

impl<'a> Frame<'a> {
    /// What is sent about a moment; none if it has no message about a skeleton.
    pub fn of(moment: &'a Moment) -> Option<Self> {
        let skeleton: &Skeleton = moment.skeleton.as_ref()?;
        let joints = skeleton.joints().map(|it| {
            let found = it.found.map(|place| Place {
                in_world: place.in_world,
                deviation_m: place.deviation_m,
            });
            (it.name, found.map_err(messages::Status::reason))
        });
        Some(Self {
            deployment: &moment.running.name,
            session: moment.running.session,
            frame: moment.frame,
            captured_at_nanos: moment.captured_at_nanos,
            status: skeleton.status().reason(),
            sides: skeleton.message().sides.name(),
            n_people: skeleton.message().n_people,
            n_missed: moment.n_missed,
            joints: joints.collect(),
        })
    }
}
