//! One person of a frame, as it is sent.

use crate::{Joint, Moment};
use messages::{Sides, Status};

/// One person of a frame, or a frame with nobody.
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
    /// Identity of the person within the run, from 1; 0 in a frame with nobody.
    pub person: u64,
    /// People that are sent of this frame.
    pub n_people: u32,
    /// "ok", or why there is no skeleton.
    pub status: &'a str,
    /// Decision on left and right, in words.
    pub sides: &'a str,
    /// Number of people that several views agree on; 0 if it was not counted.
    pub n_seen: u32,
    /// Frames that are missing before this one.
    pub n_missed: u64,
    /// The joints by name: a place, or why there is none. Empty in a frame with nobody.
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
    /// The people of a moment, the followed person first; one frame with nobody if there is nobody. Empty if skeletons
    /// were not asked for.
    pub fn people(moment: &'a Moment) -> Vec<Self> {
        let Some(skeletons) = &moment.skeletons else {
            return Vec::new();
        };
        let message = skeletons.message();
        let nobody = Self {
            deployment: &moment.running.name,
            session: moment.running.session,
            frame: moment.frame,
            captured_at_nanos: moment.captured_at_nanos,
            person: 0,
            n_people: message.n_people,
            status: skeletons.status().reason(),
            sides: Sides::AS_SEEN.name(),
            n_seen: message.n_seen,
            n_missed: moment.n_missed,
            joints: Vec::new(),
        };
        let people = skeletons.people().map(|person| Self {
            person: person.id(),
            status: person.status().reason(),
            sides: person.message().sides.name(),
            joints: person.joints().map(placed).collect(),
            ..nobody.clone()
        });
        let people: Vec<Self> = people.collect();
        if people.is_empty() {
            vec![nobody]
        } else {
            people
        }
    }
}

fn placed(joint: Joint<'_>) -> (&str, Result<Place, &str>) {
    let found = joint.found.map(|place| Place {
        in_world: place.in_world,
        deviation_m: place.deviation_m,
    });
    (joint.name, found.map_err(Status::reason))
}
