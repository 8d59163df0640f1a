//! People in photographs, from their marked joints.

use failure::{ExitKind, Failure, OrFail as _, Stop};
use footage::Fill;
use rayon::prelude::*;
use training::datasets::{Person, ReadOptions, Selection, SkeletonTable};
use viewquality::Sampler;
use viewquality::orientation::{Sample, Tile};

use super::Job;
use crate::failures::dataset_failure;
use crate::person::deal;

/// Indices of joints in `skeleton::PARSE14`.
mod joint {
    pub(super) const R_ANKLE: usize = 0;
    pub(super) const R_KNEE: usize = 1;
    pub(super) const R_HIP: usize = 2;
    pub(super) const L_HIP: usize = 3;
    pub(super) const L_KNEE: usize = 4;
    pub(super) const L_ANKLE: usize = 5;
    pub(super) const R_WRIST: usize = 6;
    pub(super) const R_ELBOW: usize = 7;
    pub(super) const R_SHOULDER: usize = 8;
    pub(super) const L_SHOULDER: usize = 9;
    pub(super) const L_ELBOW: usize = 10;
    pub(super) const L_WRIST: usize = 11;
    pub(super) const NECK: usize = 12;
    pub(super) const HEAD: usize = 13;
}

/// Shortest trunk that is used, in pixels.
const MIN_TRUNK_PX: f64 = 10.0;
/// Lean of the trunk up to which the picture is not rotated, in radians.
const MAX_LEAN: f64 = 0.35;
/// Margin of the box around the parts, in trunk lengths, as in a search.
const MARGIN: f64 = 0.25;
/// Width of the shoulders of a person seen from the front, in trunk lengths.
const SHOULDERS: f64 = 0.62;
/// Width of the hips of a person seen from the front, in trunk lengths.
const HIPS: f64 = 0.38;
/// Horizontal offsets of knees, elbows and head of a person seen from the side, added up, in trunk lengths.
const BEND: f64 = 0.35;

/// Name of a data set, and its samples.
type Named = (String, Vec<Sample>);

/// Returns the samples for training, and the samples of every data set for the evaluation.
pub(super) fn samples(job: &Job, stop: &Stop) -> Result<(Vec<Sample>, Vec<Named>), Failure> {
    let all = &job.datasets;
    let only = deal(all, "--only", &job.only, false)?;
    let judged = deal(all, "--judge", &job.judge, false)?;
    let (mut learned, mut kept) = (Vec::new(), Vec::new());
    for ((path, only), judged) in all.iter().zip(only).zip(judged) {
        let judged = selection(&judged)?;
        let read = |options: ReadOptions| -> Result<Vec<Sample>, Failure> {
            let read = training::datasets::read(path, &options).map_err(dataset_failure)?;
            let found: Result<Vec<_>, Failure> = read
                .people
                .par_iter()
                .map(|person| {
                    stop.check("stopped")?;
                    of_person(person)
                })
                .collect();
            Ok(found?.into_iter().flatten().collect())
        };
        let options = ReadOptions {
            n_joints: Some(skeleton::PARSE14.joints.len()),
            ..ReadOptions::default()
        };
        learned.extend(read(ReadOptions {
            only: selection(&only)?,
            without: judged.clone(),
            ..options.clone()
        })?);
        if judged.is_some() {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let samples = read(ReadOptions {
                only: judged,
                ..options
            })?;
            kept.push((name.into_owned(), samples));
        }
    }
    Ok((learned, kept))
}

fn selection(values: &[&str]) -> Result<Option<Selection>, Failure> {
    let one = values.first().map(|value| Selection::from_argument(value));
    one.transpose().or_fail(ExitKind::Usage)
}

/// Returns the sample of a person, rotated upright; `None` if the trunk is too short.
fn of_person(person: &Person) -> Result<Option<Sample>, Failure> {
    let [x, y] = trunk(&person.joints);
    let length = x.hypot(y);
    if length.is_nan() || length < MIN_TRUNK_PX {
        return Ok(None);
    }
    let mut sample = training::datasets::Sample::read(person).or_fail(ExitKind::Input)?;
    let lean = f64::atan2(x, -y);
    if lean.abs() >= MAX_LEAN {
        let turned = sample.rotated(lean.to_degrees(), Fill::Replicate);
        sample = turned.or_fail(ExitKind::Input)?;
    }
    let joints = &sample.joints;
    let parts = SkeletonTable::published().parts_of(joints);
    let Some(head) = viewquality::orientation::head_of(&parts) else {
        return Ok(None);
    };
    let [x, y] = trunk(joints);
    let margin = MARGIN * x.hypot(y);
    let tile = Tile::around(
        sample.image.view(),
        bounds(&parts, margin),
        head,
        &mut Sampler::default(),
    );
    Ok(tile.map(|tile| Sample {
        tile,
        front: front(joints),
        is_photograph: true,
    }))
}

/// Returns the box around points with a margin, as `[x1, y1, x2, y2]`.
fn bounds(points: &[[f64; 2]], margin: f64) -> [f64; 4] {
    let empty = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    let [x1, y1, x2, y2] = points.iter().fold(empty, |[x1, y1, x2, y2], [x, y]| {
        [x1.min(*x), y1.min(*y), x2.max(*x), y2.max(*y)]
    });
    [x1 - margin, y1 - margin, x2 + margin, y2 + margin]
}

/// Returns the vector from the middle of the hips to the neck, in pixels.
fn trunk(joints: &[[f64; 2]]) -> [f64; 2] {
    let hips = middle(joints, joint::R_HIP, joint::L_HIP);
    [0, 1].map(|axis| joints[joint::NECK][axis] - hips[axis])
}

fn middle(joints: &[[f64; 2]], a: usize, b: usize) -> [f64; 2] {
    [0, 1].map(|axis| f64::midpoint(joints[a][axis], joints[b][axis]))
}

/// Estimates the direction in which a person faces from the joints in the picture: towards the right of the picture, and towards the
/// camera.
///
/// The visible width of the shoulders and hips shows how much the person faces the camera. The bends of knees, elbows and head show the
/// sideways component. This component is less certain, so the length of the result can be less than 1.
pub(crate) fn front(joints: &[[f64; 2]]) -> [f32; 2] {
    let [x, y] = trunk(joints);
    let length = x.hypot(y);
    // Direction to the right in the picture, perpendicular to the trunk.
    let right = [-y / length, x / length];
    let along = |from: [f64; 2], to: [f64; 2]| {
        ((to[0] - from[0]) * right[0] + (to[1] - from[1]) * right[1]) / length
    };
    let between = |from: usize, to: usize| along(joints[from], joints[to]);
    let shoulders = between(joint::R_SHOULDER, joint::L_SHOULDER) / SHOULDERS;
    let hips = between(joint::R_HIP, joint::L_HIP) / HIPS;
    let towards = ((shoulders + 0.5 * hips) / 1.5).clamp(-1.0, 1.0);
    let bend =
        |joint: usize, ends: [usize; 2]| along(middle(joints, ends[0], ends[1]), joints[joint]);
    let bends = bend(joint::R_KNEE, [joint::R_HIP, joint::R_ANKLE])
        + bend(joint::L_KNEE, [joint::L_HIP, joint::L_ANKLE])
        - bend(joint::R_ELBOW, [joint::R_WRIST, joint::R_SHOULDER])
        - bend(joint::L_ELBOW, [joint::L_SHOULDER, joint::L_WRIST])
        + between(joint::NECK, joint::HEAD);
    let aside = (1.0 - towards * towards).max(0.0).sqrt() * (bends / BEND).clamp(-1.0, 1.0);
    [aside as f32, towards as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A person who faces the camera with straight limbs.
    fn standing() -> Vec<[f64; 2]> {
        let mut joints = vec![[0.0; 2]; 14];
        joints[joint::NECK] = [0.0, -100.0];
        joints[joint::HEAD] = [0.0, -150.0];
        for (side, at) in [
            (-1.0, [joint::R_HIP, joint::R_KNEE, joint::R_ANKLE]),
            (1.0, [joint::L_HIP, joint::L_KNEE, joint::L_ANKLE]),
        ] {
            for (nth, joint) in at.into_iter().enumerate() {
                joints[joint] = [19.0 * side, 90.0 * nth as f64];
            }
        }
        for (side, at) in [
            (-1.0, [joint::R_SHOULDER, joint::R_ELBOW, joint::R_WRIST]),
            (1.0, [joint::L_SHOULDER, joint::L_ELBOW, joint::L_WRIST]),
        ] {
            for (nth, joint) in at.into_iter().enumerate() {
                joints[joint] = [31.0 * side, -100.0 + 50.0 * nth as f64];
            }
        }
        joints
    }

    #[test]
    fn a_person_with_the_left_shoulder_on_the_right_of_the_picture_faces_the_camera() {
        let joints = standing();
        let [aside, towards] = front(&joints);
        assert!(towards > 0.99 && aside.abs() < 0.1, "{aside} {towards}");
        let behind: Vec<[f64; 2]> = joints.iter().map(|[x, y]| [-x, *y]).collect();
        assert!(front(&behind)[1] < -0.99);
    }

    #[test]
    fn a_person_whose_knees_point_to_the_right_of_the_picture_faces_right() {
        let mut joints = standing();
        for joint in &mut joints {
            joint[0] *= 0.1;
        }
        for knee in [joint::R_KNEE, joint::L_KNEE] {
            joints[knee][0] += 25.0;
        }
        let [aside, towards] = front(&joints);
        assert!(aside > 0.8 && towards.abs() < 0.2, "{aside} {towards}");
    }
}
