//! `pose3d-smooth.jsonl` while the run lasts: joints smoothed with what was before alone.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;

use motion::live::{FILL_S, Smoother};
use motion::{Measured, Smoothed, State, lines};
use runfiles::{FrameLine, MOST_PEOPLE, PersonLine, SmoothReport, SmoothedJoint, SmoothedPerson};

use crate::Scene;
use crate::lines::Lines;

/// The smoothers of a run, and its file.
#[derive(Debug)]
pub(crate) struct Smoothing {
    people: BTreeMap<u64, Person>,
    /// Names of the joints, then of the extra keypoints.
    names: Vec<String>,
    n_joints: usize,
    n_frames: u64,
    rate_hz: Option<f64>,
    file: Lines,
}

/// The smoother of a person, since the first frame with the person.
#[derive(Debug)]
struct Person {
    smoother: Smoother,
    counts: Vec<SmoothedJoint>,
    n_unsure: usize,
}

impl Person {
    fn new(names: &[String]) -> Self {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        Self {
            smoother: Smoother::new(&known, FILL_S),
            counts: vec![SmoothedJoint::default(); names.len()],
            n_unsure: 0,
        }
    }
}

impl Smoothing {
    pub(crate) fn begin(scene: &Scene, file: File) -> io::Result<Self> {
        let joints = scene.joints.joints.iter().map(|joint| joint.name.to_owned());
        let extras = scene.extra_keypoints.iter().cloned();
        Ok(Self {
            people: BTreeMap::new(),
            names: joints.chain(extras).collect(),
            n_joints: scene.joints.joints.len(),
            n_frames: 0,
            rate_hz: scene.frame_rate_hz.map(|rate_hz| rate_hz / scene.frame_step.max(1) as f64),
            file: Lines::new(file)?,
        })
    }

    /// Smooths the joints of everybody in a frame, and writes its line. A frame without a time is taken for one of a run at 30 Hz: the delay
    /// in the report is then wrong by the same factor.
    pub(crate) fn frame(&mut self, line: &FrameLine) -> io::Result<()> {
        let time_s = line.time_s.unwrap_or(line.frame as f64 / 30.0);
        let there: Vec<u64> = line.people.iter().map(|person| person.id).collect();
        for id in &there {
            let names = &self.names;
            self.people.entry(*id).or_insert_with(|| Person::new(names));
        }
        self.n_frames += 1;
        let ids: Vec<u64> = self.people.keys().copied().collect();
        let absent = ids.into_iter().filter(|id| !there.contains(id));
        let everybody = there.iter().copied().chain(absent);
        let smoothed = everybody.filter_map(|id| {
            let measured = line.people.iter().find(|person| person.id == id);
            self.person(id, measured, time_s)
        });
        let people = smoothed.take(MOST_PEOPLE).collect();
        let line = lines::with_people(line.clone(), people);
        self.file.append(&runfiles::to_line(&line)?)
    }

    /// * `measured`: `None` in a frame without the person.
    fn person(
        &mut self,
        id: u64,
        measured: Option<&PersonLine>,
        time_s: f64,
    ) -> Option<PersonLine> {
        let person = self.people.get_mut(&id)?;
        let place = |(nth, name): (usize, &String)| -> Option<Measured> {
            let line = measured?;
            let part = if nth < self.n_joints {
                &line.joints
            } else {
                &line.keypoints
            };
            lines::measured(part.get(name)?)
        };
        let places: Vec<Option<Measured>> = self.names.iter().enumerate().map(place).collect();
        let sides = measured.map_or_else(motion::Sides::default, lines::sides);
        person.n_unsure += usize::from(sides == motion::Sides::Unsure);
        let smoothed = person.smoother.step(time_s, &places, sides);
        for (count, joint) in person.counts.iter_mut().zip(&smoothed) {
            add(count, joint);
        }
        let joints = self.names.iter().zip(&smoothed).enumerate();
        let joints =
            joints.map(|(nth, (name, joint))| (name.as_str(), nth >= self.n_joints, joint));
        lines::smoothed(id, measured.cloned(), joints)
    }

    /// Returns the report of the smoothing since the process was started last.
    pub(crate) fn report(&self) -> SmoothReport {
        let people = self.people.iter();
        let delays = self.people.values();
        let delays = delays.filter_map(|person| person.smoother.delay_s());
        SmoothReport {
            delay_ms: delays.fold(0.0, f64::max) * 1000.0,
            fill_s: FILL_S,
            method: "kalman".to_owned(),
            n_frames: self.n_frames,
            people: people.map(|(id, person)| self.person_report(*id, person)).collect(),
            rate_hz: self.rate_hz,
            schema_version: runfiles::VERSION,
            ..SmoothReport::default()
        }
    }

    fn person_report(&self, id: u64, person: &Person) -> SmoothedPerson {
        let joints = self.names.iter().cloned();
        SmoothedPerson {
            ids: vec![id],
            joints: joints.zip(person.counts.iter().copied()).collect(),
            unsure: runfiles::Unsure {
                left_out: person.n_unsure,
                ..runfiles::Unsure::default()
            },
            ..SmoothedPerson::default()
        }
    }
}

fn add(count: &mut SmoothedJoint, it: &Smoothed) {
    let count = match it.map(|smoothed| smoothed.state) {
        Ok(State::Measured) => &mut count.measured,
        Ok(State::Exchanged) => &mut count.exchanged,
        Ok(State::Filled) => &mut count.filled,
        Ok(State::Rejected) => &mut count.rejected,
        Err(_) => &mut count.absent,
    };
    *count += 1;
}
