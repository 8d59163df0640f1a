//! `pose3d-smooth.jsonl` while the run lasts: joints smoothed with what was before alone.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;

use motion::live::{FILL_S, Smoother};
use motion::{Measured, Smoothed, State, lines};
use runfiles::{FrameLine, JointLine, SmoothReport, SmoothedJoint};

use crate::Scene;
use crate::lines::Lines;

/// The smoother of a run, and its file.
#[derive(Debug)]
pub(crate) struct Smoothing {
    smoother: Smoother,
    /// Of every joint, then of every extra keypoint.
    names: Vec<String>,
    n_joints: usize,
    counts: Vec<SmoothedJoint>,
    n_frames: u64,
    n_unsure: usize,
    rate_hz: Option<f64>,
    file: Lines,
}

impl Smoothing {
    pub(crate) fn begin(scene: &Scene, file: File) -> io::Result<Self> {
        let joints = scene.joints.joints.iter().map(|it| it.name.to_owned());
        let names: Vec<String> = joints
            .chain(scene.extra_keypoints.iter().cloned())
            .collect();
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(Self {
            smoother: Smoother::new(&known, FILL_S),
            n_joints: scene.joints.joints.len(),
            counts: vec![SmoothedJoint::default(); names.len()],
            n_frames: 0,
            n_unsure: 0,
            rate_hz: scene
                .frame_rate_hz
                .map(|it| it / scene.frame_step.max(1) as f64),
            file: Lines::new(file)?,
            names,
        })
    }

    /// Smooths the joints of a frame, and writes its line. A frame without a time is taken for one of a run at 30 Hz: the delay
    /// in the report is then wrong by the same factor.
    pub(crate) fn frame(&mut self, line: &FrameLine) -> io::Result<()> {
        let time_s = line.time_s.unwrap_or(line.frame as f64 / 30.0);
        let of = |(nth, name): (usize, &String)| -> Option<Measured> {
            let part: &BTreeMap<String, JointLine> = if nth < self.n_joints {
                &line.joints
            } else {
                &line.keypoints
            };
            lines::measured(part.get(name)?)
        };
        let measured: Vec<Option<Measured>> = self.names.iter().enumerate().map(of).collect();
        let sides = lines::sides(line);
        self.n_unsure += usize::from(sides == motion::Sides::Unsure);
        let smoothed = self.smoother.step(time_s, &measured, sides);
        self.n_frames += 1;
        for (count, it) in self.counts.iter_mut().zip(&smoothed) {
            add(count, it);
        }
        let joints = self.names.iter().zip(&smoothed).enumerate();
        let joints = joints.map(|(nth, (name, it))| (name.as_str(), nth >= self.n_joints, it));
        let line = lines::smoothed(line.clone(), joints);
        self.file.append(&runfiles::to_line(&line)?)
    }

    /// What became of it; since the process was started last.
    pub(crate) fn report(&self) -> SmoothReport {
        let joints = self.names.iter().cloned().zip(self.counts.iter().copied());
        SmoothReport {
            delay_ms: self.smoother.delay_s().unwrap_or(0.0) * 1000.0,
            fill_s: FILL_S,
            joints: joints.collect(),
            method: "kalman".to_owned(),
            n_frames: self.n_frames,
            rate_hz: self.rate_hz,
            schema_version: runfiles::VERSION,
            unsure: runfiles::Unsure {
                left_out: self.n_unsure,
                ..runfiles::Unsure::default()
            },
            ..SmoothReport::default()
        }
    }
}

fn add(count: &mut SmoothedJoint, it: &Smoothed) {
    let count = match it.map(|it| it.state) {
        Ok(State::Measured) => &mut count.measured,
        Ok(State::Exchanged) => &mut count.exchanged,
        Ok(State::Filled) => &mut count.filled,
        Ok(State::Rejected) => &mut count.rejected,
        Err(_) => &mut count.absent,
    };
    *count += 1;
}
