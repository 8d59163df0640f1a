//! Writes `pose3d-smooth.jsonl` during the run: joints are smoothed using only earlier frames.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;

use motion::live::{FILL_S, Smoother};
use motion::{Measured, Smoothed, State, lines};
use runfiles::{FrameLine, MOST_PEOPLE, PersonLine, SmoothReport, SmoothedJoint, SmoothedPerson};

use crate::Scene;
use crate::lines::Lines;
use crate::people::GONE_S;

/// The smoothers of a run, and the output file.
#[derive(Debug)]
pub(crate) struct Smoothing {
    people: BTreeMap<u64, Person>,
    /// People who would get a new id if they returned.
    gone: BTreeMap<u64, SmoothedPerson>,
    /// Names of the joints, then of the extra keypoints.
    names: Vec<String>,
    n_joints: usize,
    n_frames: u64,
    rate_hz: Option<f64>,
    file: Lines,
}

/// Smoother of one person, from the person's first frame on.
#[derive(Debug)]
struct Person {
    smoother: Smoother,
    counts: Vec<SmoothedJoint>,
    n_unsure: usize,
    /// Time of the last frame with the person, in seconds.
    seen_s: f64,
}

impl Person {
    fn new(names: &[String], seen_s: f64) -> Self {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        Self {
            smoother: Smoother::new(&known, FILL_S),
            counts: vec![SmoothedJoint::default(); names.len()],
            n_unsure: 0,
            seen_s,
        }
    }
}

impl Smoothing {
    pub(crate) fn begin(scene: &Scene, file: File) -> io::Result<Self> {
        let joints = scene.joints.joints.iter().map(|joint| joint.name.to_owned());
        let extras = scene.extra_keypoints.iter().cloned();
        Ok(Self {
            people: BTreeMap::new(),
            gone: BTreeMap::new(),
            names: joints.chain(extras).collect(),
            n_joints: scene.joints.joints.len(),
            n_frames: 0,
            rate_hz: scene.frame_rate_hz.map(|rate_hz| rate_hz / scene.frame_step.max(1) as f64),
            file: Lines::new(file)?,
        })
    }

    /// Smooths the joints of all people in a frame, and writes the frame's line. If frames have no times, a rate of 30 Hz is assumed. If
    /// the true rate differs, the delay in the report is wrong by the same factor.
    pub(crate) fn frame(&mut self, line: &FrameLine) -> io::Result<()> {
        let time_s = line.time_s.unwrap_or(line.frame as f64 / 30.0);
        let there: Vec<u64> = line.people.iter().map(|person| person.id).collect();
        for id in &there {
            let names = &self.names;
            let person = self.people.entry(*id).or_insert_with(|| Person::new(names, time_s));
            person.seen_s = time_s;
        }
        self.forget(time_s);
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

    /// Removes the smoothers of people who have been absent for too long to return with the same id, because a run of several days sees
    /// many people.
    fn forget(&mut self, time_s: f64) {
        let names = &self.names;
        let gone = self.people.extract_if(.., |_, person| time_s - person.seen_s > GONE_S);
        self.gone.extend(gone.map(|(id, person)| (id, report_of(names, id, &person))));
    }

    /// Smooths the joints of one person.
    ///
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

    /// Returns the report about the smoothing since the last start of the process.
    pub(crate) fn report(&self) -> SmoothReport {
        let gone = self.gone.values().cloned();
        let people = self.people.iter().map(|(id, person)| report_of(&self.names, *id, person));
        let delays = self.people.values();
        let delays = delays.filter_map(|person| person.smoother.delay_s());
        SmoothReport {
            delay_ms: delays.fold(0.0, f64::max) * 1000.0,
            fill_s: FILL_S,
            method: "kalman".to_owned(),
            n_frames: self.n_frames,
            people: gone.chain(people).collect(),
            rate_hz: self.rate_hz,
            schema_version: runfiles::VERSION,
            ..SmoothReport::default()
        }
    }
}

fn report_of(names: &[String], id: u64, person: &Person) -> SmoothedPerson {
    SmoothedPerson {
        ids: vec![id],
        joints: names.iter().cloned().zip(person.counts.iter().copied()).collect(),
        unsure: runfiles::Unsure {
            left_out: person.n_unsure,
            ..runfiles::Unsure::default()
        },
        ..SmoothedPerson::default()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::scene;

    #[test]
    fn smoothers_of_people_who_left_are_removed_and_their_counts_are_kept() {
        let file = tempfile::tempfile().unwrap();
        let mut smoothing = Smoothing::begin(&scene(), file).unwrap();
        for (frame, time_s, id) in [(0, 0.0, 1), (1, 30.0, 2), (2, 60.0, 2), (3, 62.0, 3)] {
            let person = PersonLine {
                id,
                ..PersonLine::default()
            };
            let line = FrameLine {
                frame,
                people: vec![person],
                reason: None,
                seen: None,
                status: FrameLine::OK.to_owned(),
                time_s: Some(time_s),
                views_missing: BTreeMap::new(),
                views_present: Vec::new(),
            };
            smoothing.frame(&line).unwrap();
        }
        assert_eq!(smoothing.people.keys().copied().collect::<Vec<_>>(), [2, 3]);
        let report = smoothing.report();
        let absent = |person: &SmoothedPerson| (person.ids[0], person.joints["head"].absent);
        let counts: Vec<_> = report.people.iter().map(absent).collect();
        assert_eq!(counts, [(1, 3), (2, 3), (3, 1)]);
    }
}
