//! Writes the 3D pose as each view sees it, in the `BODY_25` keypoint format of `OpenPose`, with one file for every view and frame.
//!
//! The format has a confidence for every keypoint. Here, this is the fraction of the views from which the joint was triangulated. The
//! standard deviation of the position in the picture has a separate key, which other programs ignore. A keypoint is written as `0, 0, 0` if
//! it was not found, is behind the camera, or is outside the picture.

use keypoints::BODY_25;
use serde_json::{Value, json};

use crate::landmarks::Landmarks;
use crate::{Seen, Trial, ViewCamera};

/// Suffix of the file of a frame.
pub const SUFFIX: &str = "_keypoints.json";

/// Returns the file of a view and a frame. People who were not found in the frame are left out. `person_id` is -1 in a run of one person.
pub fn frame(trials: &[Trial], slot: usize, view: &ViewCamera) -> String {
    let id = |trial: &Trial| (trials.len() > 1).then_some(trial.id());
    let people = trials.iter().filter_map(|trial| person(trial, id(trial), slot, view));
    json!({ "version": 1.3, "people": people.collect::<Vec<Value>>() }).to_string()
}

/// Returns a person; `None` if the view does not see the person.
fn person(trial: &Trial, id: Option<u64>, slot: usize, view: &ViewCamera) -> Option<Value> {
    let landmarks = Landmarks::of(trial);
    let (mut numbers, mut deviations) = (Vec::new(), Vec::new());
    let mut is_any = false;
    for name in BODY_25 {
        let found = keypoint(trial, slot, view, &landmarks, name);
        is_any |= found.is_some();
        let [x, y, share, deviation] = found.map_or([0.0, 0.0, 0.0, f64::NAN], |(seen, share)| {
            let deviation = seen.deviation_px().unwrap_or(f64::NAN);
            [seen.at[0], seen.at[1], share, deviation]
        });
        numbers.extend([x, y, share].map(|value| (value * 1e4).round() / 1e4));
        deviations.push((deviation * 1e2).round() / 1e2);
    }
    let id = id.map_or(Value::from(-1), Value::from);
    let person = json!({
        "person_id": [id],
        "pose_keypoints_2d": numbers,
        "pose_keypoints_sd_px": deviations,
        "face_keypoints_2d": [],
        "hand_left_keypoints_2d": [],
        "hand_right_keypoints_2d": [],
        "pose_keypoints_3d": [],
        "face_keypoints_3d": [],
        "hand_left_keypoints_3d": [],
        "hand_right_keypoints_3d": [],
    });
    is_any.then_some(person)
}

/// Returns a keypoint in the picture, and the fraction of the views from which it was triangulated.
fn keypoint(
    trial: &Trial,
    slot: usize,
    view: &ViewCamera,
    landmarks: &Landmarks,
    name: &str,
) -> Option<(Seen, f64)> {
    let points = match landmarks.points_of(name) {
        [] => vec![trial.names().position(|known| known == name)?],
        points => points.to_vec(),
    };
    let all: Option<Vec<_>> = points.iter().map(|&point| trial.point(slot, point)).collect();
    let all = all?;
    let n = all.len() as f64;
    let mut mean = **all.first()?;
    mean.in_world = landmarks.at(trial, slot, name).unwrap_or(mean.in_world);
    if all.len() > 1 {
        // The errors of the averaged joints are assumed to be independent.
        mean.covariance = core::array::from_fn(|i| {
            all.iter().map(|point| point.covariance[i]).sum::<f64>() / (n * n)
        });
        mean.views = all.iter().fold(u32::MAX, |both, it| both & it.views);
    }
    let share = f64::from(mean.views.count_ones()) / trial.views.len().max(1) as f64;
    let seen = view.see(&mean).filter(|seen| view.holds(seen.at))?;
    // If it is not known which views were used for a joint, the fraction is 0.01: a fraction of zero would mean that the joint was not
    // found.
    Some((seen, share.clamp(0.01, 1.0)))
}

/// Returns the name of the file of a frame: `cam01_000000000012_keypoints.json`.
pub fn file_name(view: &str, frame: u64) -> String {
    format!("{view}_{frame:012}{SUFFIX}")
}

#[cfg(test)]
mod tests {
    use keypoints::files::openpose;

    use super::*;
    use crate::testing::{camera, walker};

    #[test]
    fn written_keypoints_are_read_back_at_their_pixels() {
        let (trial, view) = (walker(3), camera());
        let text = frame(core::slice::from_ref(&trial), 1, &view);
        let read = openpose::parse(text.as_bytes(), None).unwrap().people;
        assert_eq!(read.len(), 1);
        let knee = BODY_25.iter().position(|name| *name == "left knee").unwrap();
        let index = trial.names().position(|name| name == "left knee").unwrap();
        let due = view.see(trial.point(1, index).unwrap()).unwrap();
        let found = read[0].keypoints[knee].unwrap();
        for axis in 0..2 {
            assert!((found.at[axis] - due.at[axis]).abs() < 1e-3);
        }
        assert!(read[0].keypoints[0].is_none(), "no joint set has a nose");
    }

    #[test]
    fn each_visible_person_has_their_own_index() {
        let view = camera();
        let [one, mut other] = [walker(3), walker(3)];
        other.ids = vec![7];
        for point in other.slots.iter_mut().flat_map(|slot| &mut slot.points) {
            point.as_mut().unwrap().in_world.x += 0.3;
        }
        other.slots[2].points.clear();
        let alone: Value =
            serde_json::from_str(&frame(core::slice::from_ref(&one), 1, &view)).unwrap();
        assert_eq!(alone["people"][0]["person_id"], json!([-1]));
        let both = [one, other];
        let read = |slot| serde_json::from_str::<Value>(&frame(&both, slot, &view)).unwrap();
        let people = read(1)["people"].as_array().unwrap().clone();
        let ids: Vec<&Value> = people.iter().map(|person| &person["person_id"]).collect();
        assert_eq!(ids, [&json!([1]), &json!([7])]);
        let place = &alone["people"][0]["pose_keypoints_2d"];
        assert_eq!(people[0]["pose_keypoints_2d"], *place);
        assert_ne!(people[1]["pose_keypoints_2d"], *place);
        assert_eq!(read(2)["people"].as_array().map(Vec::len), Some(1));
    }

    #[test]
    fn a_gap_has_no_people_and_a_missing_joint_is_zeros() {
        let (mut trial, view) = (walker(3), camera());
        trial.slots[0].points.clear();
        assert!(frame(core::slice::from_ref(&trial), 0, &view).contains("\"people\":[]"));
        trial.slots[1].points[0] = Err(crate::Gap("implausible".into()));
        let value: Value =
            serde_json::from_str(&frame(core::slice::from_ref(&trial), 1, &view)).unwrap();
        let person = &value["people"][0];
        // Keypoint 11 is the right ankle.
        for nth in 33..36 {
            assert_eq!(person["pose_keypoints_2d"][nth], 0.0);
        }
        assert_eq!(person["pose_keypoints_sd_px"][11], Value::Null);
    }
}
