//! Converts the segments of a motion capture model to the 20 joint ends of `HumanEva`.
//!
//! The files contain four points for each segment of Vicon's Plug-in-Gait model: the origin (`PELO`) and one point on each axis: anterior
//! (`PELA`, x), lateral (`PELL`, y) and proximal (`PELP`, z). The data set's toolbox (version 1.1) computes joints from these points, with
//! corrections. The pelvis is moved 50 mm back, and the trunk leans back by half the width of the shoulders. The upper arms are rotated by
//! half the offset of the shoulder. The head is 316.103 mm long. This module computes the same joints, but is not a translation of that
//! code.

use formats::c3d::C3d;
use geometry::rotation_from_matrix;
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use statistics::score::Point;

/// Length of the head, in mm.
const HEAD_MM: f64 = 316.103;
/// Shift of the pelvis along its anterior axis, in mm.
const PELVIS_MM: f64 = -50.0;
/// Half the size of a marker, in mm.
const HALF_MARKER_MM: f64 = 7.0;

/// The markers that must all be visible in a pose, each with its possible names.
const MARKERS: [&[&str]; 39] = [
    &["RASI"],
    &["LASI"],
    &["LPSI"],
    &["RPSI"],
    &["STRN"],
    &["CLAV"],
    &["T10"],
    &["C7"],
    &["RBAK"],
    &["LFHD"],
    &["RFHD"],
    &["LBHD"],
    &["RBHD"],
    &["LSHO"],
    &["LUPA"],
    &["LELB"],
    &["LFRM", "LFRA"],
    &["LWRA"],
    &["LWRB"],
    &["LFIN"],
    &["RSHO"],
    &["RUPA"],
    &["RELB"],
    &["RFRM", "RFRA"],
    &["RWRA"],
    &["RWRB"],
    &["RFIN"],
    &["LTHI"],
    &["LKNE"],
    &["LTIB"],
    &["LANK"],
    &["LHEE"],
    &["LTOE"],
    &["RTHI"],
    &["RKNE"],
    &["RTIB"],
    &["RANK"],
    &["RHEE"],
    &["RTOE"],
];

/// The measures of a subject that the joints depend on, in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Measures {
    /// Half the distance between the shoulder markers, minus half a marker.
    pub(crate) half_shoulders: f64,
    /// Offsets of the left and of the right shoulder.
    pub(crate) shoulder_offsets: [f64; 2],
}

impl Measures {
    /// Reads the measures from the static trial and the text of the `.mp` file; `None` if either is incomplete.
    pub(crate) fn new(still: &C3d, parameters: &str) -> Option<Self> {
        let [left, right] = ["LSHO", "RSHO"].map(|name| still.point(name));
        let (left, right) = (left?, right?);
        let width = |frame: usize| {
            let [left, right] = [left, right].map(|marker| seen(still, frame, marker));
            Some((left? - right?).norm())
        };
        let widths: Vec<f64> = (0..still.n_frames()).filter_map(width).collect();
        if widths.is_empty() {
            return None;
        }
        let mean = widths.iter().sum::<f64>() / widths.len() as f64;
        let left = parameter(parameters, "LShoulderOffset")?;
        let right = parameter(parameters, "RShoulderOffset")?;
        Some(Self {
            half_shoulders: mean / 2.0 - HALF_MARKER_MM,
            shoulder_offsets: [left, right],
        })
    }
}

/// A value in the text of an `.mp` file, whose lines are `$Name = value`.
fn parameter(text: &str, name: &str) -> Option<f64> {
    let value = |line: &str| {
        let (key, value) = line.split_once('=')?;
        let value: f64 = value.trim().parse().ok()?;
        (key.trim().trim_start_matches('$').contains(name) && value.is_finite()).then_some(value)
    };
    text.lines().find_map(value)
}

/// The points of a trial from which the joints are computed.
#[derive(Debug)]
pub(crate) struct Body<'a> {
    trial: &'a C3d,
    measures: Measures,
    markers: Vec<usize>,
}

impl<'a> Body<'a> {
    /// Finds the markers.
    ///
    /// # Errors
    ///
    /// Returns the name of the first missing point.
    pub(crate) fn new(trial: &'a C3d, measures: Measures) -> Result<Self, String> {
        let marker = |names: &&[&str]| {
            let found = names.iter().find_map(|name| trial.point(name));
            found.ok_or_else(|| names[0].to_owned())
        };
        let markers = MARKERS.iter().map(marker).collect::<Result<_, _>>()?;
        let axes = ["O", "A", "L", "P"];
        let of_segment = |segment: &str| axes.map(|axis| format!("{segment}{axis}"));
        let points = SEGMENTS.into_iter().flat_map(of_segment);
        let missing = |name: &String| trial.point(name).is_none();
        let mut points = points.chain(ORIGINS.map(str::to_owned));
        if let Some(name) = points.find(missing) {
            return Err(name);
        }
        Ok(Self {
            trial,
            measures,
            markers,
        })
    }

    /// The 20 joint ends of `skeleton::HUMANEVA20`, in the file's unit (mm), at a frame (from 1, fractional).
    ///
    /// * Returns `None` outside the trial, and if a marker is missing in either neighbouring frame.
    pub(crate) fn joints(&self, at: f64) -> Option<[Point; 20]> {
        // This comparison is also false for NaN.
        if !(at >= 1.0 && at.ceil() <= self.trial.n_frames() as f64) {
            return None;
        }
        let (low, high) = (at.floor() as usize - 1, at.ceil() as usize - 1);
        let is_seen =
            |&marker: &usize| [low, high].iter().all(|f| seen(self.trial, *f, marker).is_some());
        if !self.markers.iter().all(is_seen) {
            return None;
        }
        let pose = Pose {
            trial: self.trial,
            frames: [low, high],
            share: at - at.floor(),
        };
        let mut joints = [[0.0; 3]; 20];
        joints[0..2].copy_from_slice(&self.trunk(&pose)?);
        let [left, right] = self.measures.shoulder_offsets;
        joints[2..6].copy_from_slice(&arm(&pose, ["LCLO", "LHU", "LHUO", "LRA", "LRAO"], left)?);
        joints[6..10].copy_from_slice(&arm(&pose, ["RCLO", "RHU", "RHUO", "RRA", "RRAO"], right)?);
        joints[10..14].copy_from_slice(&leg(&pose, ["LFEP", "LFE", "LFEO", "LTI", "LTIO"])?);
        joints[14..18].copy_from_slice(&leg(&pose, ["RFEP", "RFE", "RFEO", "RTI", "RTIO"])?);
        let head = pose.segment("HED", "TRXO")?;
        joints[18..20].copy_from_slice(&[along(&head, 0.0), along(&head, HEAD_MM)]);
        Some(joints)
    }

    /// Upper and lower end of the trunk.
    fn trunk(&self, pose: &Pose<'_>) -> Option<[Point; 2]> {
        let length = pose.length("TRXO", "PELO")?;
        let lean = (self.measures.half_shoulders / 2.0).atan2(length);
        let pelvis =
            pose.segment("PEL", "PELO")? * Translation3::new(PELVIS_MM, 0.0, 0.0) * backwards(lean);
        Some([along(&pelvis, length), along(&pelvis, 0.0)])
    }
}

/// The segments whose axes are needed.
const SEGMENTS: [&str; 10] = [
    "PEL", "HED", "LHU", "LRA", "RHU", "RRA", "LFE", "RFE", "LTI", "RTI",
];

/// Other points that are needed.
const ORIGINS: [&str; 3] = ["TRXO", "LCLO", "RCLO"];

/// A rotation about the lateral axis that moves the proximal end backwards.
fn backwards(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -angle)
}

/// A point on the z axis of a segment.
fn along(segment: &Isometry3<f64>, mm: f64) -> Point {
    (segment * Point3::new(0.0, 0.0, mm)).into()
}

/// Ends of the upper and of the lower arm. The z axes point towards the shoulder.
///
/// * `names`: shoulder, segment and origin of the upper arm, segment and origin of the lower arm.
fn arm(pose: &Pose<'_>, names: [&str; 5], offset: f64) -> Option<[Point; 4]> {
    let [shoulder, upper, elbow, lower, wrist] = names;
    let (length, lower_length) = (pose.length(shoulder, elbow)?, pose.length(elbow, wrist)?);
    let mut upper = pose.segment(upper, shoulder)?;
    let mut lower = pose.segment(lower, elbow)?;
    let turn = (offset / 2.0).atan2(length);
    let end = |upper: &Isometry3<f64>| upper * Point3::new(0.0, 0.0, -length);
    let gap = Point3::from(lower.translation.vector) - end(&upper);
    upper *= backwards(-turn);
    lower.translation = Translation3::from(end(&upper) + gap);
    lower *= backwards(turn);
    Some([
        along(&upper, 0.0),
        along(&upper, -length),
        along(&lower, 0.0),
        along(&lower, -lower_length),
    ])
}

/// Ends of the upper and of the lower leg. The z axes point towards the hip.
///
/// * `names`: hip, segment and origin of the thigh, segment and origin of the shin.
fn leg(pose: &Pose<'_>, names: [&str; 5]) -> Option<[Point; 4]> {
    let [hip, thigh, knee, shin, ankle] = names;
    let (length, lower_length) = (pose.length(hip, knee)?, pose.length(knee, ankle)?);
    let thigh = pose.segment(thigh, hip)?;
    let shin = pose.segment(shin, knee)?;
    Some([
        along(&thigh, 0.0),
        along(&thigh, -length),
        along(&shin, 0.0),
        along(&shin, -lower_length),
    ])
}

/// The trial at a time between two of its frames.
struct Pose<'a> {
    trial: &'a C3d,
    frames: [usize; 2],
    share: f64,
}

impl Pose<'_> {
    fn points(&self, name: &str) -> Option<[Vector3<f64>; 2]> {
        let point = self.trial.point(name)?;
        let [low, high] = self.frames.map(|frame| seen(self.trial, frame, point));
        Some([low?, high?])
    }

    /// Mean distance between two points over the two frames.
    fn length(&self, from: &str, to: &str) -> Option<f64> {
        let (from, to) = (self.points(from)?, self.points(to)?);
        Some(f64::midpoint(
            (from[0] - to[0]).norm(),
            (from[1] - to[1]).norm(),
        ))
    }

    /// The axes of a segment, moved to a different origin. The origin is interpolated linearly, the rotation spherically.
    fn segment(&self, axes: &str, origin: &str) -> Option<Isometry3<f64>> {
        let [o, x, y, z] = ["O", "A", "L", "P"].map(|name| self.points(&format!("{axes}{name}")));
        let (o, x, y, z) = (o?, x?, y?, z?);
        let turn = |frame: usize| {
            let columns = [x, y, z].map(|points| (points[frame] - o[frame]).try_normalize(1e-9));
            let [Some(x), Some(y), Some(z)] = columns else {
                return None;
            };
            rotation_from_matrix(&Matrix3::from_columns(&[x, y, z])).ok()
        };
        let (low, high) = (turn(0)?, turn(1)?);
        let rotation = low.try_slerp(&high, self.share, 1e-9).unwrap_or(low);
        let [low, high] = self.points(origin)?;
        let origin = low.lerp(&high, self.share);
        Some(Isometry3::from_parts(origin.into(), rotation))
    }
}

/// A point in a frame; `None` if the file marks the point as lost, or if it is exactly at the origin.
fn seen(trial: &C3d, frame: usize, point: usize) -> Option<Vector3<f64>> {
    let position = trial.frame(frame)[point]?;
    (position != [0.0; 3]).then(|| position.into())
}

#[cfg(test)]
pub(crate) mod tests;
