//! Reads the files of a run as people over time.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use crate::recorded::Sides;
use crate::{Joint, Recorded, Role, lines};
use failure::{ExitKind, Failure, in_file};
use geometry::files::ReadOptions;
use nalgebra::UnitVector3;
use runfiles::{FrameLine, JointLine, Line as _, PersonLine};
use serde_json::Value;

/// A finished run.
#[derive(Debug)]
pub struct Run {
    /// The instants, in seconds, in ascending order.
    pub times: Vec<f64>,
    /// The frame number of every instant.
    pub frames: Vec<u64>,
    /// The people, by ascending id; all of them have the same instants.
    pub people: Vec<Person>,
    /// Description of the missing part, if the end of the file is missing.
    pub cut: Option<String>,
}

/// A person of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Ids of the person within the run, in ascending order. A person has several ids if no frame contains two people and the followed
    /// person had several ids one after the other.
    pub ids: Vec<u64>,
    /// Id at every instant; at instants without the person, the previous id.
    pub id_at: Vec<u64>,
    /// The measured joints.
    pub recorded: Recorded,
    /// Number of joints; the entries after these are extra keypoints.
    pub n_joints: usize,
}

/// A [`Person`] that is being built while the lines are read.
#[derive(Debug, Default)]
struct Gathered {
    ids: BTreeSet<u64>,
    id_at: Vec<u64>,
    sides: Vec<Sides>,
    joints: Vec<Joint>,
    keypoints: Vec<Joint>,
}

impl Gathered {
    /// Adds the person of a line.
    fn add(&mut self, at: usize, person: &PersonLine) {
        let before = self.id_at.last().copied();
        self.id_at.resize(at, before.unwrap_or(person.id));
        self.id_at.push(person.id);
        self.ids.insert(person.id);
        self.sides.resize(at, Sides::default());
        self.sides.push(lines::sides(person));
        add(&mut self.joints, at, &person.joints);
        add(&mut self.keypoints, at, &person.keypoints);
    }

    fn finish(mut self, times: &[f64]) -> Person {
        let last = self.id_at.last().copied();
        self.id_at.resize(times.len(), last.unwrap_or(0));
        let n_joints = self.joints.len();
        self.joints.append(&mut self.keypoints);
        for joint in &mut self.joints {
            joint.measured.resize(times.len(), None);
        }
        self.sides.resize(times.len(), Sides::default());
        Person {
            ids: self.ids.into_iter().collect(),
            id_at: self.id_at,
            recorded: Recorded {
                times: times.to_vec(),
                sides: self.sides,
                joints: self.joints,
            },
            n_joints,
        }
    }
}

/// Reads the lines of `pose3d.jsonl`, one after the other.
///
/// * `each`: called with every line and its number, counted from 0.
/// * Returns a description of the missing part at the end, if the last line is incomplete.
///
/// # Errors
///
/// The file cannot be read, or a line is not valid.
pub fn read_lines(
    folder: &Path,
    mut each: impl FnMut(usize, FrameLine) -> Result<(), Failure>,
) -> Result<Option<String>, Failure> {
    let path = folder.join(FrameLine::FILE);
    let file = files::open(&path).map_err(|error| unopened(folder, &path, &error))?;
    let mut reader = BufReader::new(file);
    let mut text = String::new();
    let mut nth = 0;
    loop {
        text.clear();
        let n = reader.read_line(&mut text).map_err(|error| in_file(&path, &error))?;
        if n == 0 {
            return Ok(None);
        }
        let is_whole = text.ends_with('\n');
        match runfiles::lines::<FrameLine>(&text).next() {
            Some(Ok(line)) => each(nth, line)?,
            Some(Err(_)) if !is_whole => {
                let what = format!(
                    "line {} of {} is truncated and was left out",
                    nth + 1,
                    FrameLine::FILE
                );
                return Ok(Some(what));
            }
            Some(Err(mut error)) => {
                error.line += nth;
                return Err(Failure::new(
                    ExitKind::Input,
                    format!("{}: {error}", path.display()),
                ));
            }
            None => {}
        }
        nth += 1;
    }
}

fn unopened(folder: &Path, path: &Path, error: &std::io::Error) -> Failure {
    let part = folder.join(format!("{}.part", FrameLine::FILE));
    let hint = if part.exists() {
        "the run has not ended, because the names of its files still end in .part"
    } else {
        "give the folder that the key `output` of the deployment names"
    };
    in_file(path, error).with_hint(hint)
}

/// Reads a run.
///
/// # Errors
///
/// A file cannot be read, a line is not valid, or times do not ascend.
pub fn read(folder: &Path, rate_hz: Option<f64>) -> Result<Run, Failure> {
    let (mut times, mut frames) = (Vec::new(), Vec::new());
    let mut people: BTreeMap<u64, Gathered> = BTreeMap::new();
    // If there are never two people at once, all ids belong to one person, who may get another id after a gap or a jump.
    let (mut one, mut is_one) = (Gathered::default(), true);
    let path = folder.join(FrameLine::FILE);
    let cut = read_lines(folder, |nth, line| {
        let time_s = rate_hz.map_or(line.time_s, |rate| Some(line.frame as f64 / rate));
        let time_s = time_s.ok_or_else(|| {
            let what = format!("{}: line {} has no time", path.display(), nth + 1);
            Failure::new(ExitKind::Input, what).with_hint("set the frame rate with --rate-hz")
        })?;
        if let Some(&before_s) = times.last()
            && time_s <= before_s
        {
            let what = format!(
                "{}: times must increase: line {} is at {time_s} s, but the previous line is at {before_s} s",
                path.display(),
                nth + 1
            );
            let hint = "sort the lines by time, or use --rate-hz to compute the times from the frame numbers";
            return Err(Failure::new(ExitKind::Input, what).with_hint(hint));
        }
        for (nth, person) in line.people.iter().enumerate() {
            if nth == 0 {
                one.add(times.len(), person);
            }
            let own = people.entry(person.id).or_default();
            own.add(times.len(), person);
        }
        is_one &= line.people.len() < 2;
        times.push(time_s);
        frames.push(line.frame);
        Ok(())
    })?;
    if frames.is_empty() {
        let what = format!("{} has no lines", path.display());
        return Err(Failure::new(ExitKind::Input, what));
    }
    let people: Vec<Gathered> = match is_one {
        true if people.is_empty() => Vec::new(),
        true => vec![one],
        false => people.into_values().collect(),
    };
    let people = people.into_iter();
    Ok(Run {
        people: people.map(|person| person.finish(&times)).collect(),
        times,
        frames,
        cut,
    })
}

/// Adds the joints of a line; joints that the line does not contain were not measured.
fn add<'a>(
    joints: &mut Vec<Joint>,
    at: usize,
    line: impl IntoIterator<Item = (&'a String, &'a JointLine)>,
) {
    for (name, it) in line {
        let known = joints.iter().position(|joint| joint.name == *name);
        let joint = known.unwrap_or_else(|| {
            joints.push(Joint {
                name: name.clone(),
                role: Role::of(name),
                measured: Vec::new(),
            });
            joints.len() - 1
        });
        let measured = &mut joints[joint].measured;
        measured.resize(at, None);
        measured.push(lines::measured(it));
    }
}

/// Returns the deployment that is stored in the folder of a run, if it can be read.
fn deployment_of(folder: &Path) -> Option<Value> {
    let text = files::read_text(&folder.join("deployment.json"), files::SETTINGS).ok()?;
    let value: Value = serde_json::from_str(&text).ok()?;
    value.get("deployment").cloned()
}

/// Returns the direction against gravity in the world of a run: from its deployment, otherwise from its calibration if that still exists.
pub(crate) fn up(folder: &Path) -> Option<UnitVector3<f64>> {
    let deployment = deployment_of(folder)?;
    if let Ok(up) = serde_json::from_value::<[f64; 3]>(deployment.get("up")?.clone()) {
        return geometry::direction(up);
    }
    let rig = deployment.get("rig")?.as_str()?;
    let rig = geometry::files::read(Path::new(rig), &ReadOptions::default()).ok()?;
    rig.up_in_world()
}
