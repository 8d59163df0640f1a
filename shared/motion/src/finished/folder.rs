//! What a run left, as a person over time.

use std::io::{BufRead as _, BufReader};
use std::path::Path;

use crate::{Joint, Recorded, Role, lines};
use failure::{ExitKind, Failure, in_file};
use geometry::files::ReadOptions;
use nalgebra::UnitVector3;
use runfiles::{FrameLine, JointLine, Line as _};
use serde_json::Value;

/// A run.
#[derive(Debug)]
pub struct Run {
    /// The measured joints.
    pub recorded: Recorded,
    /// The number of the frame of every instant.
    pub frames: Vec<u64>,
    /// The joints before this are joints, the others extra keypoints.
    pub n_joints: usize,
    /// What is missing at the end of the file, in words.
    pub cut: Option<String>,
}

/// Lines of `pose3d.jsonl`, one after the other.
///
/// * `each`: gets every line and its number, from 0.
/// * Returns what is missing at the end: a last line that is not whole.
///
/// # Errors
///
/// The file cannot be read, or a line is none.
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
        let n = reader
            .read_line(&mut text)
            .map_err(|error| in_file(&path, &error))?;
        if n == 0 {
            return Ok(None);
        }
        let is_whole = text.ends_with('\n');
        match runfiles::lines::<FrameLine>(&text).next() {
            Some(Ok(line)) => each(nth, line)?,
            Some(Err(_)) if !is_whole => {
                let what = format!(
                    "line {} of {} is cut off, and was left out",
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
        "the run has not ended: its files are still called *.part"
    } else {
        "give the folder that `output` of the deployment names"
    };
    in_file(path, error).with_hint(hint)
}

/// Reads a run.
///
/// # Errors
///
/// A file cannot be read, a line is none, or times do not ascend.
pub fn read(folder: &Path, rate_hz: Option<f64>) -> Result<Run, Failure> {
    let mut run = Run {
        recorded: Recorded::default(),
        frames: Vec::new(),
        n_joints: 0,
        cut: None,
    };
    let mut keypoints: Vec<Joint> = Vec::new();
    let path = folder.join(FrameLine::FILE);
    let cut = read_lines(folder, |nth, line| {
        let time_s = rate_hz.map_or(line.time_s, |rate| Some(line.frame as f64 / rate));
        let time_s = time_s.ok_or_else(|| {
            let what = format!("{}: line {} has no time", path.display(), nth + 1);
            Failure::new(ExitKind::Input, what)
                .with_hint("--rate-hz says how many frames there are per second")
        })?;
        let recorded = &mut run.recorded;
        if let Some(&before_s) = recorded.times.last()
            && time_s <= before_s
        {
            let what = format!(
                "{}: line {} is at {time_s} s, not after {before_s} s of the line before it",
                path.display(),
                nth + 1
            );
            let hint = "lines must be in the order of their times; --rate-hz takes the times from the numbers of the frames";
            return Err(Failure::new(ExitKind::Input, what).with_hint(hint));
        }
        let at = recorded.times.len();
        recorded.times.push(time_s);
        recorded.sides.push(lines::sides(&line));
        run.frames.push(line.frame);
        add(&mut recorded.joints, at, &line.joints);
        add(&mut keypoints, at, &line.keypoints);
        Ok(())
    })?;
    let recorded = &mut run.recorded;
    run.n_joints = recorded.joints.len();
    recorded.joints.append(&mut keypoints);
    for joint in &mut recorded.joints {
        joint.measured.resize(recorded.times.len(), None);
    }
    if run.frames.is_empty() {
        let what = format!("{} has no line", path.display());
        return Err(Failure::new(ExitKind::Input, what));
    }
    run.cut = cut;
    Ok(run)
}

/// Adds the joints of a line; those that it does not name have not been measured.
fn add<'a>(
    joints: &mut Vec<Joint>,
    at: usize,
    line: impl IntoIterator<Item = (&'a String, &'a JointLine)>,
) {
    for (name, it) in line {
        let known = joints.iter().position(|it| it.name == *name);
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

/// What the deployment of a run says of itself, if it can be read.
fn deployment_of(folder: &Path) -> Option<Value> {
    let text = files::read_text(&folder.join("deployment.json"), files::SETTINGS).ok()?;
    let value: Value = serde_json::from_str(&text).ok()?;
    value.get("deployment").cloned()
}

/// Against gravity in the world of a run: from its deployment, else from its calibration if that is still there.
pub(crate) fn up(folder: &Path) -> Option<UnitVector3<f64>> {
    let deployment = deployment_of(folder)?;
    if let Ok(up) = serde_json::from_value::<[f64; 3]>(deployment.get("up")?.clone()) {
        return UnitVector3::try_new(up.into(), 1e-9);
    }
    let rig = deployment.get("rig")?.as_str()?;
    let rig = geometry::files::read(Path::new(rig), &ReadOptions::default()).ok()?;
    rig.up_in_world()
}
