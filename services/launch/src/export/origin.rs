//! Source of an export: the folder of a run, or its recording.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use exports::{Gathering, Trial, TrialError, ViewCamera};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use geometry::{Framing, OutSize, Rig};
use messages::{Joint3d, SkeletonMessage, Skeletons, Status, topic};
use nalgebra::UnitVector3;
use recording::{Kind, Recording};
use runfiles::{FrameLine, JointLine, Line as _, PersonLine, PlacedJoint};
use skeleton::JointSet;

use crate::recorded;
use crate::resolved::Resolved;

/// Choice between a run's original and smoothed trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lines {
    /// The trajectories as the run found them.
    #[default]
    Raw,
    /// The trajectories smoothed by `parallax smooth`.
    Smooth,
}

impl Lines {
    /// Returns the name of the file with these trajectories.
    pub fn file(self) -> &'static str {
        match self {
            Self::Raw => FrameLine::FILE,
            Self::Smooth => FrameLine::SMOOTHED_FILE,
        }
    }
}

/// The user's options for a run.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// Name of the trial in the files.
    pub name: String,
    /// Choice of trajectories.
    pub lines: Lines,
    /// Frames of the footage per second, if the run has no frame rate.
    pub rate_hz: Option<f64>,
    /// Upward direction in world coordinates, which replaces the direction in the rig.
    pub up: Option<UnitVector3<f64>>,
}

/// A run to be exported.
#[derive(Debug)]
pub struct Origin {
    /// Trajectories of each person. There is at least one person.
    pub trials: Vec<Trial>,
    /// Folder of the run, or its recording.
    pub source: PathBuf,
    /// Choice of trajectories.
    pub lines: Lines,
    /// Descriptions of missing or damaged parts of the run.
    pub flaws: Vec<String>,
    /// Reason why the rig could not be read for the upward direction. `None` if the rig was read, even if it does not give the direction.
    pub up_unknown: Option<String>,
    /// The deployment and its rig, or the reason why they are missing.
    pub setup: Result<(Resolved, Rig), String>,
    /// The recording, if the run is read from one.
    pub recording: Option<Recording>,
}

impl Origin {
    /// Reads a run.
    ///
    /// # Errors
    ///
    /// Fails if `source` is neither the folder of a run nor a recording, or a line cannot be read. Fails with `Degraded` if no frame has a
    /// joint.
    pub fn read(source: &Path, given: &Given) -> Result<Self, Failure> {
        let mut flaws = Vec::new();
        let (resolved, recording, gathering);
        if source.is_dir() {
            recording = None;
            resolved = of_folder(source);
            let views = views(resolved.as_ref().ok());
            gathering = lines(source, given.lines, views, &mut flaws)?;
        } else if given.lines == Lines::Smooth {
            let message = format!(
                "{} is not a folder: recordings only contain measured trajectories",
                source.display()
            );
            return Err(Failure::new(ExitKind::Usage, message));
        } else {
            let found = recorded::open(source)?;
            let settings = recorded::settings(source, &found)?.resolved;
            gathering = messages(source, &found, &settings, &mut flaws)?;
            recording = Some(found);
            resolved = Ok(settings);
        }
        let n_lines = gathering.n_lines();
        let mut trials = gathering.finish(&given.name, given.rate_hz).map_err(|error| {
            let kind = match error {
                TrialError::Empty | TrialError::NoPoint { .. } => ExitKind::Degraded,
                TrialError::Joints(_) | TrialError::Range { .. } => ExitKind::Input,
            };
            // A part of the run may be missing.
            let message = format!("{}: {error}; nothing was written", source.display());
            Failure::new(kind, [&[message], &flaws[..]].concat().join("\n  "))
        })?;
        // All trials have the same frames and times.
        check_rate(&trials[0], given)?;
        flaws.extend(of_times(&trials[0], n_lines));
        let setup = resolved.and_then(|resolved| {
            let rig = inputs::rig_of(&resolved.deployment).map_err(|error| error.to_string())?;
            Ok((resolved, rig))
        });
        let up_in_world = given.up.or_else(|| setup.as_ref().ok()?.1.up_in_world());
        for trial in &mut trials {
            trial.up_in_world = up_in_world;
        }
        let up_unknown = setup.as_ref().err().filter(|_| given.up.is_none()).cloned();
        Ok(Self {
            trials,
            source: source.to_owned(),
            lines: given.lines,
            flaws,
            up_unknown,
            setup,
            recording,
        })
    }

    /// Returns the cameras, with intrinsics for the pictures of their footage.
    ///
    /// # Errors
    ///
    /// Fails if there is no deployment or no rig, or the rig lacks a camera.
    pub(super) fn cameras(&self) -> Result<Vec<ViewCamera>, Failure> {
        let (resolved, rig) = self.setup()?;
        (0..resolved.deployment.cameras.len())
            .map(|nth| camera(resolved, rig, nth))
            .collect()
    }

    pub(super) fn setup(&self) -> Result<(&Resolved, &Rig), Failure> {
        match &self.setup {
            Ok((resolved, rig)) => Ok((resolved, rig)),
            Err(why) => {
                let message = format!("the cameras of the run are not known: {why}");
                Err(Failure::new(ExitKind::Input, message))
            }
        }
    }
}

/// Refuses a frame rate that contradicts the run.
fn check_rate(trial: &Trial, given: &Given) -> Result<(), Failure> {
    if let Some(rate_hz) = given.rate_hz
        && trial
            .rate_hz
            .is_some_and(|hz| (hz * trial.frame_step as f64 / rate_hz - 1.0).abs() > 1e-6)
    {
        let own = trial.rate_hz.unwrap_or_default();
        let message = format!(
            "--rate {rate_hz} contradicts the times of the run, which has {own} frames per second"
        );
        return Err(Failure::new(ExitKind::Usage, message));
    }
    Ok(())
}

/// Describes the faults of the frames and their times.
fn of_times(trial: &Trial, n_lines: usize) -> Vec<String> {
    let mut flaws = Vec::new();
    if trial.n_repeated > 0 {
        let n = trial.n_repeated;
        flaws.push(format!(
            "{n} of {n_lines} lines repeat the frame of an earlier line, and are left out"
        ));
    }
    if trial.n_irregular > 0 {
        let n = trial.n_irregular;
        flaws.push(format!(
            "the times of {n} frames are off the grid of the frame rate by a quarter of an interval or more"
        ));
    }
    flaws
}

/// Returns a camera, with intrinsics for the pictures of its footage.
pub(super) fn camera(resolved: &Resolved, rig: &Rig, nth: usize) -> Result<ViewCamera, Failure> {
    let entry = &resolved.deployment.cameras[nth];
    let refused = |why: String| {
        Failure::new(
            ExitKind::Calibration,
            format!("camera {:?}: {why}", entry.name),
        )
    };
    let camera = rig
        .camera(&entry.name)
        .ok_or_else(|| refused(format!("{} has no camera of this name", rig.source())))?;
    let footage = resolved.footage.get(nth);
    let size = footage.map_or(camera.intrinsics.size, |footage| footage.size);
    let whole = OutSize::Scale(1.0);
    let framing = Framing::new(camera, size, entry.source_offset_px, whole, 0.0)
        .map_err(|error| refused(error.to_string()))?;
    Ok(super::of_footage(&entry.name, &framing, size))
}

fn views(resolved: Option<&Resolved>) -> Vec<String> {
    let cameras = resolved.map_or(&[][..], |resolved| &resolved.deployment.cameras);
    cameras.iter().map(|camera| camera.name.clone()).collect()
}

fn of_folder(folder: &Path) -> Result<Resolved, String> {
    let file = folder.join("deployment.json");
    let text = files::read_text(&file, files::SETTINGS);
    let text = text.map_err(|error| format!("{}: {error}", file.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))
}

/// Reads `pose3d.jsonl` line by line. If the run has not ended, reads the lines written so far.
fn lines(
    folder: &Path,
    which: Lines,
    views: Vec<String>,
    flaws: &mut Vec<String>,
) -> Result<Gathering, Failure> {
    let name = which.file();
    let [whole, part] = [name.to_owned(), format!("{name}.part")].map(|name| folder.join(name));
    let is_whole = whole.exists() || !part.exists();
    let path = if is_whole { whole } else { part };
    let file = files::open(&path).map_err(|error| {
        in_file(&path, &error).with_hint(match which {
            Lines::Raw => "give the folder of a finished run, or an MCAP file",
            Lines::Smooth => "run `parallax smooth` first, which writes this file",
        })
    })?;
    if !is_whole {
        flaws.push(format!(
            "{} belongs to a run that has not ended",
            path.display()
        ));
    }
    let mut gathering = Gathering::new(views);
    let mut input = BufReader::new(file);
    let mut text = String::new();
    for number in 1_usize.. {
        text.clear();
        let n = input.read_line(&mut text).map_err(|error| in_file(&path, &error))?;
        if n == 0 {
            break;
        }
        let line = match runfiles::lines::<FrameLine>(&text).next() {
            Some(Ok(line)) => line,
            None => continue,
            Some(Err(_)) if !text.ends_with('\n') => {
                flaws.push(format!(
                    "{}: line {number} is truncated, and left out",
                    path.display()
                ));
                break;
            }
            Some(Err(mut error)) => {
                error.line = number;
                return Err(in_file(&path, &error));
            }
        };
        gathering.push(&line).map_err(|error| in_file(&path, &error))?;
    }
    Ok(gathering)
}

/// Reads the results of a recording.
fn messages(
    file: &Path,
    recording: &Recording,
    resolved: &Resolved,
    flaws: &mut Vec<String>,
) -> Result<Gathering, Failure> {
    if !recorded::is_undamaged(recording) {
        flaws.push(recorded::text(file, recording));
    }
    let name = &resolved.deployment.person.joints;
    let joints = JointSet::by_name(name);
    let joints = joints.ok_or_else(|| {
        let message = format!("{}: no joint set is called {name:?}", file.display());
        Failure::new(ExitKind::Input, message)
    })?;
    let mut input = files::open(file).map_err(|error| in_file(file, &error))?;
    let mut gathering = Gathering::new(views(Some(resolved)));
    let track = recording.tracks.get(&topic::skeletons());
    let (mut buffer, mut n_damaged) = (recording::Buffer::default(), 0);
    for entry in track.map_or(&[][..], |track| &track.entries) {
        let message = match recording::read(&mut input, Kind::Skeletons, entry, &mut buffer) {
            Ok(message) => message,
            Err(error @ recording::ReadError::Read(_)) => return Err(in_file(file, &error)),
            Err(_) => {
                n_damaged += 1;
                continue;
            }
        };
        let Some(skeletons) = message.skeletons() else {
            n_damaged += 1;
            continue;
        };
        if skeletons.status != Status::END {
            let line = line(&skeletons, joints, resolved);
            gathering.push(&line).or_fail(ExitKind::Input)?;
        }
    }
    if n_damaged > 0 {
        flaws.push(format!(
            "{}: {n_damaged} results are damaged, and left out",
            file.display()
        ));
    }
    Ok(gathering)
}

/// Returns the line of a result, with the fields that an export needs.
fn line(skeletons: &Skeletons, joints: &JointSet, resolved: &Resolved) -> FrameLine {
    let frame = skeletons.stamp.frame;
    let people = skeletons.listed().iter();
    FrameLine {
        frame,
        people: people.map(|message| person(message, joints, resolved)).collect(),
        reason: None,
        seen: None,
        status: skeletons.status.reason().to_owned(),
        time_s: resolved.frame_rate_hz().map(|rate_hz| frame as f64 / rate_hz),
        views_missing: BTreeMap::new(),
        views_present: Vec::new(),
    }
}

fn person(message: &SkeletonMessage, joints: &JointSet, resolved: &Resolved) -> PersonLine {
    let point = |message: &Joint3d| of_message(message, resolved);
    let has_joints = message.n_joints as usize == joints.joints.len();
    let listed = message.listed_joints().iter().filter(|_| has_joints);
    let names = joints.joints.iter().map(|joint| joint.name.to_owned());
    let extras = message.listed_keypoints().iter();
    PersonLine {
        id: message.id,
        joints: names.zip(listed.map(point)).collect(),
        keypoints: resolved.extra_keypoints.iter().cloned().zip(extras.map(point)).collect(),
        pairs: message.n_pairs,
        status: message.status.reason().to_owned(),
        ..PersonLine::default()
    }
}

fn of_message(it: &Joint3d, resolved: &Resolved) -> JointLine {
    if it.status != Status::OK {
        let status = it.status.reason().to_owned();
        return JointLine::Missing { status };
    }
    let cameras = resolved.deployment.cameras.iter().enumerate();
    let used = cameras.filter(|(view, _)| *view < 32 && it.views_used >> view & 1 == 1);
    JointLine::Placed(PlacedJoint {
        covariance_m2: it.covariance,
        position_m: it.in_world,
        reprojection_px: Some(it.reprojection_px),
        views: used.map(|used| used.1.name.clone()).collect(),
    })
}
