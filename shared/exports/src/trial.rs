//! Results of a run, with one entry for every instant at the frame rate (the grid).

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Point3, Rotation3, UnitVector3};
use runfiles::{FrameLine, JointLine, PersonLine};
use skeleton::JointSet;

/// Maximum number of instants on the grid. It is more than a day at 50 Hz; a larger number is caused by a wrong frame number.
const MAX_SLOTS: u64 = 5_000_000;
/// Limit of coordinates, in metres. A larger coordinate counts as missing.
const MAX_COORDINATE: f64 = 1e6;
/// States of smoothed points that were not measured.
const FILLED: [&str; 2] = ["filled", "rejected"];
/// Maximum distance of a time from the grid, as a fraction of the grid's spacing.
const TOLERANCE: f64 = 0.25;

/// A point in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position in the world of the rig, in metres.
    pub in_world: Point3<f64>,
    /// Covariance, in square metres: xx, xy, xz, yy, yz, zz; NaN if unknown.
    pub covariance: [f64; 6],
    /// Root mean square distance of the point's reprojections from the observations of the views, in pixels of their frames.
    pub reprojection_px: Option<f64>,
    /// Bit `v` is set if the point was triangulated from view `v` of [`Trial::views`].
    pub views: u32,
    /// True if the point was not measured in this frame, but filled in by smoothing.
    pub is_filled: bool,
}

impl Point {
    /// Returns the covariance as a matrix; `None` if it is not known.
    pub fn covariance(&self) -> Option<Matrix3<f64>> {
        let [xx, xy, xz, yy, yz, zz] = self.covariance;
        let all = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        all.iter().all(|value| value.is_finite()).then_some(all)
    }

    /// Returns the expected root mean square error of the position, in metres; `None` if it is not known.
    pub fn deviation_m(&self) -> Option<f64> {
        let trace = self.covariance()?.trace();
        (trace >= 0.0).then(|| trace.sqrt())
    }
}

/// Reason why a point has no position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap(pub Box<str>);

/// An instant on the grid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Slot {
    /// Id of the person with these points; `None` if there is no person.
    pub person: Option<u64>,
    /// `ok`, or the reason why there is no skeleton; empty if the run has no line for this frame.
    pub status: Box<str>,
    /// Joints, then extra keypoints; empty if there is no result.
    pub points: Vec<Result<Point, Gap>>,
}

/// One person of a run. All trials of a run have the same instants (slots). If the person is absent at an instant, the slot has no points.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Name of the run in the files.
    pub name: String,
    /// Ids of the person within the run, ascending. A person has several ids if no frame contains two people and the followed person had
    /// several ids one after the other.
    pub ids: Vec<u64>,
    /// Set of joints.
    pub joints: &'static JointSet,
    /// Names of the points after the joints: extra keypoints of networks.
    pub extras: Vec<String>,
    /// Names of the views, in the numbering of [`Point::views`].
    pub views: Vec<String>,
    /// Number of instants per second, if known.
    pub rate_hz: Option<f64>,
    /// Number, in the footage, of the first instant's frame.
    pub first_frame: u64,
    /// Difference between the frame numbers of two neighbouring instants.
    pub frame_step: u64,
    /// Upward direction in the world, if the rig states it.
    pub up_in_world: Option<UnitVector3<f64>>,
    /// The instants of the grid.
    pub slots: Vec<Slot>,
    /// Number of frames whose time differs from their instant on the grid by a quarter of the spacing or more.
    pub n_irregular: usize,
    /// Number of lines that were left out because an earlier line was about the same frame.
    pub n_repeated: usize,
}

impl Trial {
    /// Iterates over the names of all points: joints, then extra keypoints.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let joints = self.joints.joints.iter().map(|joint| joint.name);
        joints.chain(self.extras.iter().map(String::as_str))
    }

    /// Returns the names of all points with underscores for blanks, as formats of motion capture require.
    pub fn labels(&self) -> Vec<String> {
        self.names().map(|name| name.replace(' ', "_")).collect()
    }

    /// Returns the lowest id of the person.
    pub fn id(&self) -> u64 {
        self.ids.first().copied().unwrap_or(0)
    }

    /// Returns the id of the person at an instant; `None` if it is not known.
    pub fn id_at(&self, slot: usize) -> Option<u64> {
        let only = self.ids.first().filter(|_| self.ids.len() == 1);
        self.slots[slot].person.or(only.copied())
    }

    /// Returns the number of points of an instant.
    pub fn n_points(&self) -> usize {
        self.joints.joints.len() + self.extras.len()
    }

    /// Returns a point at an instant; `None` in a gap.
    pub fn point(&self, slot: usize, point: usize) -> Option<&Point> {
        self.slots.get(slot)?.points.get(point)?.as_ref().ok()
    }

    /// Iterates over all points at an instant.
    pub fn points(&self, slot: usize) -> impl Iterator<Item = Option<&Point>> {
        (0..self.n_points()).map(move |point| self.point(slot, point))
    }

    /// Returns the number, in the footage, of an instant's frame.
    pub fn frame(&self, slot: usize) -> u64 {
        self.first_frame + slot as u64 * self.frame_step
    }

    /// Returns the time at which an instant's frame was taken, in seconds after frame 0 of the footage.
    pub fn time_s(&self, slot: usize) -> Option<f64> {
        let rate_hz = self.rate_hz?;
        Some(self.frame(slot) as f64 / self.frame_step as f64 / rate_hz)
    }

    /// Returns the numbers of the first and the last frame of every run of frames in which a point has no position.
    pub fn gaps(&self, point: usize) -> Vec<[u64; 2]> {
        self.runs(|slot| self.point(slot, point).is_none())
    }

    /// Returns the numbers of the first and the last frame of every run of frames in which smoothing filled in a point.
    pub fn filled(&self, point: usize) -> Vec<[u64; 2]> {
        self.runs(|slot| self.point(slot, point).is_some_and(|found| found.is_filled))
    }

    fn runs(&self, is_in: impl Fn(usize) -> bool) -> Vec<[u64; 2]> {
        let mut runs: Vec<[u64; 2]> = Vec::new();
        for slot in (0..self.slots.len()).filter(|&i| is_in(i)) {
            let frame = self.frame(slot);
            match runs.last_mut() {
                Some(run) if run[1] + self.frame_step == frame => run[1] = frame,
                _ => runs.push([frame; 2]),
            }
        }
        runs
    }

    /// Returns the number of instants with at least one point.
    pub fn n_with_points(&self) -> usize {
        let has = |slot: &&Slot| slot.points.iter().any(Result::is_ok);
        self.slots.iter().filter(has).count()
    }

    /// Returns the rotation of the world after which z points up; the identity if up is unknown.
    pub fn z_up_from_world(&self) -> Rotation3<f64> {
        let turn = self.up_in_world.as_ref().map(geometry::z_up_from_world);
        turn.unwrap_or_else(Rotation3::identity)
    }

    /// Returns the rotation of the world after which y points up; the identity if up is unknown.
    pub fn y_up_from_world(&self) -> Rotation3<f64> {
        let turn = self.up_in_world.as_ref().map(geometry::y_up_from_world);
        turn.unwrap_or_else(Rotation3::identity)
    }
}

/// Reason why the lines of a run cannot be exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// There is no line.
    #[error("there is no frame")]
    Empty,
    /// There is no point in any frame.
    #[error("none of {frames} frames has a 3D joint")]
    NoPoint {
        /// Number of lines.
        frames: usize,
    },
    /// The joints do not belong to a known set.
    #[error("the joints are not those of a known set: {0}")]
    Joints(String),
    /// Two frames are too far apart.
    #[error(
        "frames {first} and {last} are {slots} frames apart, more than {MAX_SLOTS}: one of the numbers must be wrong"
    )]
    Range {
        /// Number of the first frame.
        first: u64,
        /// Number of the last frame.
        last: u64,
        /// Number of instants between the two frames.
        slots: u64,
    },
}

/// Status of an instant with other people, but without this person.
const NOT_THERE: &str = "not there";

/// Collects the lines of a run, one at a time and in any order, and makes a [`Trial`] for each person.
#[derive(Debug, Clone, Default)]
pub struct Gathering {
    joints: Option<&'static JointSet>,
    extras: Vec<String>,
    views: Vec<String>,
    frames: Vec<Gathered>,
}

/// Content of one line.
#[derive(Debug, Clone)]
struct Gathered {
    frame: u64,
    time_s: Option<f64>,
    /// Status of people who are not mentioned in the line.
    status: Box<str>,
    people: Vec<(u64, Slot)>,
}

impl Gathering {
    /// Starts without lines.
    ///
    /// * `views`: the cameras in the order of the run. Other cameras that occur in the lines are appended.
    pub fn new(views: Vec<String>) -> Self {
        Self {
            views,
            ..Self::default()
        }
    }

    /// Adds a line of `pose3d.jsonl` or `pose3d-smooth.jsonl`.
    ///
    /// # Errors
    ///
    /// Returns [`TrialError::Joints`] if the joints belong to no known set.
    pub fn push(&mut self, line: &FrameLine) -> Result<(), TrialError> {
        let mut people = Vec::with_capacity(line.people.len());
        for person in &line.people {
            self.know(person)?;
            let slot = Slot {
                person: Some(person.id),
                status: person.status.as_str().into(),
                points: self.points(person),
            };
            people.push((person.id, slot));
        }
        let status = match &line.reason {
            Some(reason) => format!("{}: {reason}", line.status),
            None if line.has_pose() => NOT_THERE.to_owned(),
            None => line.status.clone(),
        };
        self.frames.push(Gathered {
            frame: line.frame,
            time_s: line.time_s,
            status: status.into(),
            people,
        });
        Ok(())
    }

    /// Finds the joint set of a person, and adds new extra keypoints.
    fn know(&mut self, person: &PersonLine) -> Result<(), TrialError> {
        if self.joints.is_none() && !person.joints.is_empty() {
            let is_named = |set: &&'static JointSet| {
                let has = |name: &str| person.joints.contains_key(name);
                let mut joints = set.joints.iter();
                set.joints.len() == person.joints.len() && joints.all(|joint| has(joint.name))
            };
            let found = JointSet::ALL.into_iter().find(is_named);
            let names = || person.joints.keys().cloned().collect::<Vec<_>>().join(", ");
            self.joints = Some(found.ok_or_else(|| TrialError::Joints(names()))?);
        }
        for name in person.keypoints.keys() {
            if !self.extras.contains(name) {
                self.extras.push(name.clone());
            }
        }
        Ok(())
    }

    fn points(&mut self, person: &PersonLine) -> Vec<Result<Point, Gap>> {
        let Some(set) = self.joints.filter(|_| !person.joints.is_empty()) else {
            return Vec::new();
        };
        let joints = set.joints.iter().map(|joint| joint.name);
        let mut points: Vec<_> =
            joints.map(|name| self.point(name, person.joints.get(name), person)).collect();
        for name in self.extras.clone() {
            points.push(self.point(&name, person.keypoints.get(&name), person));
        }
        points
    }

    fn point(
        &mut self,
        name: &str,
        joint: Option<&JointLine>,
        person: &PersonLine,
    ) -> Result<Point, Gap> {
        let placed = match joint {
            None => return Err(Gap("".into())),
            Some(JointLine::Missing { status }) => return Err(Gap(status.as_str().into())),
            Some(JointLine::Placed(placed)) => placed,
        };
        let is_place = |value: &f64| value.is_finite() && value.abs() <= MAX_COORDINATE;
        if !placed.position_m.iter().all(is_place) {
            return Err(Gap("out of range".into()));
        }
        let views = placed.views.iter().map(|name| self.view(name));
        Ok(Point {
            in_world: placed.position_m.into(),
            covariance: placed.covariance_m2,
            reprojection_px: placed
                .reprojection_px
                .filter(|reprojection_px| reprojection_px.is_finite()),
            views: views.fold(0, |all, it| all | 1_u32.checked_shl(it).unwrap_or(0)),
            is_filled: person
                .states
                .get(name)
                .is_some_and(|state| FILLED.contains(&state.as_str())),
        })
    }

    /// Returns the number of a view.
    fn view(&mut self, name: &str) -> u32 {
        let at = self.views.iter().position(|view| view == name);
        let at = at.unwrap_or_else(|| {
            self.views.push(name.to_owned());
            self.views.len() - 1
        });
        at as u32
    }

    /// Returns the number of lines so far.
    pub fn n_lines(&self) -> usize {
        self.frames.len()
    }

    /// Returns the trials, one for each person who has a point in any frame, by ascending id. If no frame has two people, there is only one
    /// trial: the different ids are then assumed to be one person, who got another id after a gap or a jump.
    ///
    /// * `rate_hz`: frame rate of the footage, used if no line has a time.
    ///
    /// # Errors
    ///
    /// Returns a [`TrialError`] on failure.
    pub fn finish(mut self, name: &str, rate_hz: Option<f64>) -> Result<Vec<Trial>, TrialError> {
        let n_lines = self.frames.len();
        // If two lines are about the same frame, the first one is used.
        self.frames.sort_by_key(|line| line.frame);
        self.frames.dedup_by_key(|line| line.frame);
        let ends = self.frames.first().zip(self.frames.last());
        let (first, last) =
            ends.map(|(first, last)| (first.frame, last.frame)).ok_or(TrialError::Empty)?;
        let joints = self.joints.ok_or(TrialError::NoPoint { frames: n_lines })?;
        let steps = self.frames.iter().map(|line| line.frame - first);
        let step = steps.fold(0, common).max(1);
        let slots = ((last - first) / step).saturating_add(1);
        if slots > MAX_SLOTS {
            return Err(TrialError::Range { first, last, slots });
        }
        let footage_hz = rate(&self.frames).or(rate_hz);
        let n_irregular = footage_hz.map_or(0, |rate_hz| irregular(&self.frames, rate_hz, step));
        let empty = Trial {
            name: name.to_owned(),
            ids: Vec::new(),
            joints,
            extras: core::mem::take(&mut self.extras),
            views: core::mem::take(&mut self.views),
            rate_hz: footage_hz.map(|rate_hz| rate_hz / step as f64),
            first_frame: first,
            frame_step: step,
            up_in_world: None,
            slots: vec![Slot::default(); slots as usize],
            n_irregular,
            n_repeated: n_lines - self.frames.len(),
        };
        let listed = self.frames.iter().flat_map(|line| &line.people);
        let has_point = |slot: &Slot| slot.points.iter().any(Result::is_ok);
        let people = listed.filter(|(_, slot)| has_point(slot));
        let people: BTreeSet<u64> = people.map(|(person, _)| *person).collect();
        if people.is_empty() {
            return Err(TrialError::NoPoint { frames: n_lines });
        }
        let people: Vec<u64> = people.into_iter().collect();
        let is_one = self.frames.iter().all(|line| line.people.len() < 2);
        let groups: Vec<Vec<u64>> = if is_one {
            vec![people]
        } else {
            people.into_iter().map(|person| vec![person]).collect()
        };
        let groups = groups.into_iter();
        Ok(groups
            .map(|ids| {
                let trial = Trial {
                    ids,
                    ..empty.clone()
                };
                self.trial(trial, is_one)
            })
            .collect())
    }

    /// Puts the points of a person into the instants of the grid.
    ///
    /// * `is_one`: true if no frame has two people, so that the person in every frame is the followed one.
    fn trial(&mut self, mut trial: Trial, is_one: bool) -> Trial {
        let n_points = trial.n_points();
        for line in &mut self.frames {
            let mut people = line.people.iter();
            let at = people.position(|(person, _)| is_one || *person == trial.id());
            let mut slot = at.map_or_else(
                || Slot {
                    person: None,
                    status: line.status.clone(),
                    points: Vec::new(),
                },
                |at| line.people.swap_remove(at).1,
            );
            if !slot.points.is_empty() {
                slot.points.resize_with(n_points, || Err(Gap("".into())));
            }
            let place = (line.frame - trial.first_frame) / trial.frame_step;
            trial.slots[place as usize] = slot;
        }
        trial
    }
}

/// Returns the greatest common divisor.
fn common(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common(b, a % b) }
}

/// Returns the frames of the footage per second, from the first and the last line with a time. The result has nine digits, because times
/// are rounded.
fn rate(frames: &[Gathered]) -> Option<f64> {
    let mut timed = frames.iter().filter_map(|line| Some((line.frame, line.time_s?)));
    let first = timed.next()?;
    let last = timed.next_back();
    let (frames, seconds) = match last {
        Some(last) => (last.0 - first.0, last.1 - first.1),
        None => (first.0, first.1),
    };
    let rate_hz = frames as f64 / seconds;
    let is_rate = rate_hz.is_finite() && rate_hz > 0.0;
    is_rate.then(|| format!("{rate_hz:.9e}").parse().unwrap_or(rate_hz))
}

fn irregular(frames: &[Gathered], rate_hz: f64, step: u64) -> usize {
    let off = |line: &Gathered| {
        let time_s = line.time_s?;
        Some((time_s * rate_hz - line.frame as f64).abs() / step as f64)
    };
    let off = frames.iter().filter_map(off);
    off.filter(|slots| *slots >= TOLERANCE).count()
}

#[cfg(test)]
mod tests;
