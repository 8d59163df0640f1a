//! Films (the joints of people over time, one film per camera), by which the clocks of a deployment's cameras can be compared. The joints
//! are read from keypoint files, or found by a network in the footage.

mod eyes;
mod upright;

use core::ops::Range;

use calibration::synchronisation::{Film, Joint, Person, Shot};
use capture::Feed;
use deployment::Deployment;
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use footage::{FrameView, SourceSpec};
use geometry::{Camera, Rig, upright_roll};
use keypoints::keypointfiles::KeypointSource;
use keypoints::{Keypoint, joint_rows, mirrored};
use skeleton::{PARSE14, SIDES};

use crate::keypoints as keypoint_files;
use eyes::Eyes;
use upright::Upright;

/// The part of the footage to use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Use every n-th frame.
    pub every: u64,
    /// Start in each camera's footage, in seconds.
    pub from_s: f64,
    /// Duration in seconds; `None` to use the footage up to its end.
    pub seconds: Option<f64>,
}

/// Knowledge of the poses of the cameras: known from the rig, or unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Poses {
    /// The poses in the rig are right. Pictures are turned upright before people are searched in them, as in a run.
    OfRig,
    /// Poses are unknown.
    Unknown,
}

/// The films of all cameras.
#[derive(Debug)]
pub struct Films {
    /// The cameras, in the order of the deployment.
    pub cameras: Vec<Camera>,
    /// Film of each camera, with times of the camera's own clock.
    pub films: Vec<Film>,
    /// Number of joints of a person.
    pub n_joints: usize,
    /// For each joint, the joint on the other side of the body. Set if, for at least one camera, left and right are named as seen in the
    /// picture.
    pub mirror: Option<Vec<usize>>,
    /// For each joint, the joint on the other side of the body.
    pub sides: Vec<usize>,
    /// For each camera, a description of the source of its joints, for the user.
    pub finders: Vec<String>,
}

/// Source of the joints of a camera.
enum Finder {
    Keypoints(KeypointSource),
    Eyes(Box<Eyes>),
}

/// Reads or finds the people in all cameras.
///
/// # Errors
///
/// Fails if a camera is live or not in the rig, an input cannot be read, or a stop is requested.
pub fn films(
    deployment: &Deployment,
    part: Part,
    poses: Poses,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Films, Failure> {
    let deployment = &crate::cameras::settled(deployment)?;
    let rig = match poses {
        Poses::OfRig => inputs::rig_of(deployment)?,
        Poses::Unknown => inputs::lenses_of(deployment)?,
    };
    let cameras = cameras(deployment, &rig)?;
    let finders = (0..cameras.len()).map(|i| finder(deployment, i));
    let finders: Vec<Finder> = finders.collect::<Result<_, Failure>>()?;
    let names: Vec<Vec<String>> = finders.iter().map(Finder::names).collect();
    let extra = extra(&names);
    let is_as_seen = finders.iter().any(Finder::as_seen);
    let texts = finders.iter().map(Finder::text).collect();
    let mut films = Vec::new();
    for (nth, finder) in finders.into_iter().enumerate() {
        let entry = &deployment.cameras[nth];
        let reader = Reader {
            rows: rows(&names[nth], &extra),
            offset: entry.source_offset_px.unwrap_or([0, 0]).map(f64::from),
            name: &entry.name,
            roll: roll(deployment, &rig, (&cameras[nth], poses)),
            stop,
            console,
        };
        films.push(match finder {
            Finder::Keypoints(source) => {
                let rate_hz = keypoint_rate(deployment, nth)?;
                reader.of_keypoints(&source, rate_hz, part)?
            }
            Finder::Eyes(eyes) => reader.of_footage(deployment, nth, *eyes, part)?,
        });
    }
    console.finish();
    Ok(Films {
        cameras,
        n_joints: PARSE14.joints.len() + extra.len(),
        mirror: is_as_seen.then(|| mirror(&extra)),
        sides: mirror(&extra),
        finders: texts,
        films,
    })
}

/// Returns the cameras of a deployment, in its order.
///
/// # Errors
///
/// Fails if a camera is live or not in the rig.
pub fn cameras(deployment: &Deployment, rig: &Rig) -> Result<Vec<Camera>, Failure> {
    let of_entry = |camera: &deployment::capture::Camera| {
        if crate::cameras::is_live(&camera.source) {
            let message = format!(
                "camera {:?} is live, so it has no footage to compare with that of other cameras",
                camera.name
            );
            let failure = Failure::new(ExitKind::Config, message);
            return Err(failure.with_hint("use footage that was recorded with this camera"));
        }
        inputs::camera_of(rig, &camera.name, deployment).cloned()
    };
    deployment.cameras.iter().map(of_entry).collect()
}

/// Returns the angle that turns the pictures of a camera upright, in radians. Returns 0 if the angle is not known or not wanted.
fn roll(deployment: &Deployment, rig: &Rig, (camera, poses): (&Camera, Poses)) -> f64 {
    if poses == Poses::Unknown || !deployment.capture.upright {
        return 0.0;
    }
    upright_roll(camera, rig).unwrap_or(0.0)
}

fn finder(deployment: &Deployment, camera: usize) -> Result<Finder, Failure> {
    if let Some(source) = keypoint_files::of_camera(&deployment.cameras[camera])? {
        return Ok(Finder::Keypoints(source));
    }
    Ok(Finder::Eyes(Box::new(Eyes::open(deployment, camera)?)))
}

impl Finder {
    fn names(&self) -> Vec<String> {
        match self {
            Self::Keypoints(source) => source.names().names().to_vec(),
            Self::Eyes(eyes) => eyes.names().to_vec(),
        }
    }

    fn as_seen(&self) -> bool {
        matches!(self, Self::Eyes(eyes) if eyes.as_seen())
    }

    fn text(&self) -> String {
        match self {
            Self::Keypoints(_) => "keypoint files".to_owned(),
            Self::Eyes(eyes) => eyes.text(),
        }
    }
}

/// Returns the keypoints, other than the joints, that at least two cameras have.
fn extra(names: &[Vec<String>]) -> Vec<String> {
    let mut extra: Vec<String> = Vec::new();
    for name in names.iter().flatten() {
        let n = names.iter().filter(|other| other.contains(name)).count();
        if n > 1 && !keypoints::is_joint(name) && !extra.contains(name) {
            extra.push(name.clone());
        }
    }
    extra
}

/// Joints as weighted sums of keypoints.
type Rows = Vec<Option<Vec<(usize, f64)>>>;

fn rows(names: &[String], extra: &[String]) -> Rows {
    let of_extra = |wanted: &String| {
        let at = names.iter().position(|name| name == wanted)?;
        Some(vec![(at, 1.0)])
    };
    let mut rows = joint_rows(names);
    rows.extend(extra.iter().map(of_extra));
    rows
}

/// Returns the joint on the other side of each joint.
fn mirror(extra: &[String]) -> Vec<usize> {
    let n = PARSE14.joints.len();
    let mut mirror: Vec<usize> = (0..n + extra.len()).collect();
    for [right, left] in SIDES {
        (mirror[right], mirror[left]) = (left, right);
    }
    for (nth, name) in extra.iter().enumerate() {
        let other =
            mirrored(name).and_then(|other| extra.iter().position(|candidate| *candidate == other));
        mirror[n + nth] = n + other.unwrap_or(nth);
    }
    mirror
}

/// Returns the frame rate of the footage in which the keypoints were found, in frames per second.
fn keypoint_rate(deployment: &Deployment, camera: usize) -> Result<f64, Failure> {
    let entry = &deployment.cameras[camera];
    let of_footage = || {
        let spec = whole(deployment, camera, 0, 1);
        (!entry.source.is_empty()).then(|| Feed::look(&spec).ok()?.frame_rate_hz)
    };
    let rate_hz = of_footage().flatten().or(deployment.capture.frame_rate_hz);
    rate_hz.ok_or_else(|| no_rate(&entry.name))
}

fn no_rate(name: &str) -> Failure {
    let message = format!("the frame rate of camera {name:?} is not known");
    Failure::new(ExitKind::Config, message)
        .with_hint("set `capture.frame_rate_hz` in the deployment")
}

fn whole(deployment: &Deployment, camera: usize, start: u64, step: u64) -> SourceSpec {
    SourceSpec {
        start,
        step,
        count: None,
        ..crate::cameras::source(&deployment.cameras[camera], &deployment.capture)
    }
}

/// Reads the film of one camera.
struct Reader<'a> {
    rows: Rows,
    /// Offset from pixels of the footage to pixels of the calibrated picture.
    offset: [f64; 2],
    name: &'a str,
    /// Angle by which pictures are turned, in radians, clockwise as seen.
    roll: f64,
    stop: &'a Stop,
    console: &'a dyn Console,
}

impl Reader<'_> {
    fn of_keypoints(
        &self,
        source: &KeypointSource,
        rate_hz: f64,
        part: Part,
    ) -> Result<Film, Failure> {
        let frames = part.frames(source.n_frames(), rate_hz);
        self.begin(&frames, part);
        let mut found = Vec::new();
        let mut shots = Vec::new();
        for frame in frames.step_by(part.every as usize) {
            self.stop.check("interrupted")?;
            let known = source.of_frame(frame, &mut found).or_fail(ExitKind::Input)?;
            self.console.advance(1);
            if known.is_some() {
                shots.push(Shot {
                    time_s: frame as f64 / rate_hz,
                    people: found.iter().map(|person| self.person(&person.keypoints)).collect(),
                });
            }
        }
        Ok(Film { shots })
    }

    fn of_footage(
        &self,
        deployment: &Deployment,
        camera: usize,
        eyes: Eyes,
        part: Part,
    ) -> Result<Film, Failure> {
        let info = Feed::look(&whole(deployment, camera, 0, 1)).or_fail(ExitKind::Input)?;
        let rate_hz = info.frame_rate_hz.ok_or_else(|| no_rate(self.name))?;
        let frames = part.frames(info.n_frames, rate_hz);
        self.begin(&frames, part);
        if frames.is_empty() {
            return Ok(Film::default());
        }
        let spec = whole(deployment, camera, frames.start, part.every);
        let mut feed = Feed::open(&spec).or_fail(ExitKind::Input)?;
        let mut upright = Upright::new(info.size, self.roll)?;
        let size = upright.as_ref().map_or(info.size, Upright::size);
        let mut watch = eyes.watch(deployment, size, rate_hz / part.every as f64);
        let mut shots = Vec::new();
        loop {
            self.stop.check("interrupted")?;
            let Some(frame) = feed.next_frame().or_fail(ExitKind::Input)? else {
                break;
            };
            if frame.index >= frames.end {
                break;
            }
            let mut people = match &mut upright {
                None => watch.people(self.name, &frame, size)?,
                Some(upright) => {
                    let rgb = upright.turned(frame.rgb);
                    watch.people(self.name, &FrameView { rgb, ..frame }, size)?
                }
            };
            if let Some(upright) = &upright {
                for it in &mut people {
                    upright.back(it);
                }
            }
            self.console.advance(1);
            shots.push(Shot {
                time_s: frame.index as f64 / rate_hz,
                people: people.iter().map(|person| self.person(person)).collect(),
            });
        }
        Ok(Film { shots })
    }

    fn begin(&self, frames: &Range<u64>, part: Part) {
        let n = (frames.end - frames.start).div_ceil(part.every);
        self.console.begin(self.name, "");
        self.console.set(0, n as usize);
    }

    fn person(&self, found: &[Option<Keypoint>]) -> Person {
        let joint = |row: &Vec<(usize, f64)>| {
            let (mut at, mut score) = ([0.0; 2], f64::INFINITY);
            for &(keypoint, weight) in row {
                let it = (*found.get(keypoint)?)?;
                at = [0, 1].map(|axis| at[axis] + weight * it.at[axis]);
                score = score.min(it.score);
            }
            let at = [0, 1].map(|axis| at[axis] + self.offset[axis]);
            Some(Joint { at, score })
        };
        let joints = self.rows.iter().map(|row| joint(row.as_ref()?));
        Person {
            joints: joints.collect(),
        }
    }
}

impl Part {
    /// Returns the range of frames to use, of `n_frames`.
    fn frames(self, n_frames: u64, rate_hz: f64) -> Range<u64> {
        let start = ((self.from_s * rate_hz).round() as u64).min(n_frames);
        let most = self.seconds.map(|second| (second * rate_hz).round() as u64);
        let end = most.map_or(n_frames, |most| start.saturating_add(most).min(n_frames));
        start..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_requested_part_is_limited_to_the_footage() {
        let part = |from_s, seconds| Part {
            every: 1,
            from_s,
            seconds,
        };
        assert_eq!(part(0.0, None).frames(100, 25.0), 0..100);
        assert_eq!(part(1.0, Some(2.0)).frames(100, 25.0), 25..75);
        assert_eq!(part(3.0, Some(2.0)).frames(100, 25.0), 75..100);
        assert!(part(9.0, None).frames(100, 25.0).is_empty());
    }

    #[test]
    fn extra_keypoints_of_a_single_camera_are_not_compared() {
        let names =
            |all: &[&str]| -> Vec<String> { all.iter().map(|&name| name.to_owned()).collect() };
        let each = [
            names(&["left hip", "right hip", "left heel", "nose", "right heel"]),
            names(&["left hip", "left heel", "right heel", "chin"]),
        ];
        let extra = extra(&each);
        assert_eq!(extra, ["left heel", "right heel"]);
        let rows = rows(&each[1], &extra);
        assert_eq!(rows[3], Some(vec![(0, 1.0)]), "the left hip");
        assert_eq!(rows[14..], [Some(vec![(1, 1.0)]), Some(vec![(2, 1.0)])]);
        assert_eq!(mirror(&extra)[14..], [15, 14]);
        assert_eq!(mirror(&extra)[..3], [5, 4, 3]);
    }
}
