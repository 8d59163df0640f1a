//! One person of a frame, in the form in which it is sent.

use crate::{Joint, Moment};
use messages::{Sides, Status};

/// One person of a frame, or a frame without people.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame<'a> {
    /// Name of the deployment.
    pub deployment: &'a str,
    /// Session of the run.
    pub session: u64,
    /// Number of the frame.
    pub frame: u64,
    /// Time at which the frame was captured, in nanoseconds of `CLOCK_MONOTONIC`.
    pub captured_at_nanos: u64,
    /// The person's id within the run, counted from 1; 0 in a frame without people.
    pub person: u64,
    /// Number of people of this frame that are sent.
    pub n_people: u32,
    /// "ok", or the reason why there is no skeleton.
    pub status: &'a str,
    /// Decision on left and right, in words.
    pub sides: &'a str,
    /// Number of people on whom several views agree; 0 if they were not counted.
    pub n_seen: u32,
    /// Number of frames that are missing before this one.
    pub n_missed: u64,
    /// The joints by name, each with its position or the reason why it has none. Empty in a frame without people.
    pub joints: Vec<(&'a str, Result<Place, &'a str>)>,
}

/// Position of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position in the world frame of the calibration, in metres.
    pub in_world: [f64; 3],
    /// Standard deviation along one axis, in metres.
    pub deviation_m: f64,
}

impl<'a> Frame<'a> {
    /// Returns the people of a moment, the followed person first. If there are no people, returns one frame without people. Empty if
    /// skeletons were not requested.
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
