//! Tests of several people in real processes: their identities are kept, even if processes are killed.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use core::fmt::Write as _;
use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};
use serde_json::Value;

use crate::common::Case;
use crate::common::started::{processes, signal};
use crate::maps::{N, joints_at, rig};

const N_PEOPLE: usize = 3;
/// A found person who is within this distance of a true person, in metres, counts as that person. The true people are always further apart.
const NEAR_M: f64 = 0.3;

/// Returns the joints of a person who walks on a circle, in metres.
fn joints(person: usize, frame: usize) -> [Point3<f64>; N] {
    let turn = core::f64::consts::TAU * person as f64 / N_PEOPLE as f64;
    let angle = turn + 0.02 * frame as f64;
    let place = Vector3::new(0.6 * angle.cos(), 0.6 * angle.sin(), 0.0);
    joints_at(0.0).map(|joint| joint + place)
}

/// Writes the keypoints of all people in the layout of OpenPose, and a deployment that reads them. The order of people differs from frame
/// to frame and from view to view.
fn write_keypoints(case: &Case, n_frames: usize) {
    let name = &case.name;
    let mut text = format!("name = {name:?}\nrig = \"rig.toml\"\noutput = \"out\"\n");
    text.push_str("[capture]\nframe_rate_hz = 30.0\nmode = \"paced\"\n");
    for (view, camera) in rig().cameras().iter().enumerate() {
        let folder = case.path(&camera.name);
        for frame in 0..n_frames {
            let mut people: Vec<String> = Vec::new();
            for person in 0..N_PEOPLE {
                let numbers = joints(person, frame).map(|joint| {
                    let at = camera.project(&joint).unwrap();
                    format!("{:.2},{:.2},0.9", at.x, at.y)
                });
                let numbers = numbers.join(",");
                people.push(format!("{{\"pose_keypoints_2d\":[{numbers}]}}"));
            }
            people.rotate_left((frame + view) % N_PEOPLE);
            let file = folder.join(format!("{}_{frame:012}_keypoints.json", camera.name));
            std::fs::write(file, format!("{{\"people\":[{}]}}", people.join(","))).unwrap();
        }
        let name = &camera.name;
        write!(text, "[[camera]]\nname = {name:?}\nkeypoints = {name:?}\n").unwrap();
        text.push_str("keypoint_names = \"lsp-14\"\n");
    }
    case.write("deployment.toml", text);
}

/// Returns the mean distance of a skeleton's joints from the truth, in metres.
fn off_m(person: &Value, truth: &[Point3<f64>; N]) -> f64 {
    let joints = person["joints"].as_object().unwrap();
    let (mut sum, mut n) = (0.0, 0.0);
    for (joint, truth) in skeleton::PARSE14.joints.iter().zip(truth) {
        let at = &joints[joint.name]["position_m"];
        if let (Some(x), Some(y), Some(z)) = (at[0].as_f64(), at[1].as_f64(), at[2].as_f64()) {
            sum += (Point3::new(x, y, z) - truth).norm();
            n += 1.0;
        }
    }
    sum / n
}

/// Returns the id of every person in every frame; `None` if no person was found at this position.
fn ids(lines: &[Value]) -> Vec<[Option<u64>; N_PEOPLE]> {
    let of_frame = |line: &Value| {
        let frame = line["frame"].as_u64().unwrap() as usize;
        let people = line["people"].as_array().unwrap();
        core::array::from_fn(|person| {
            let truth = joints(person, frame);
            let near = people.iter().find(|found| off_m(found, &truth) < NEAR_M)?;
            near["id"].as_u64()
        })
    };
    lines.iter().map(of_frame).collect()
}

#[test]
fn three_people_keep_their_ids_if_any_process_is_killed() {
    const VICTIMS: [&str; 4] = ["fuse", "pose --index 2", "triangulate", "fuse"];
    let n_frames = 60 * (VICTIMS.len() + 1);
    let case = Case::with_rig(&rig(), "everybody", &[0; 4], "");
    write_keypoints(&case, n_frames);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    for (nth, victim) in VICTIMS.iter().enumerate() {
        let begin = 30 + 60 * nth as u64;
        started.until("the next kill", |_| {
            let lines = case.lines("pose3d.jsonl");
            lines.last().is_some_and(|line| line["frame"].as_u64().unwrap() >= begin)
        });
        assert!(processes(case.folder()).len() > 4);
        signal("KILL", started.pid_of(victim).into());
    }
    started.wait().ends(7);
    case.assert_nothing_left();
    let ids = ids(&case.lines("pose3d.jsonl"));
    for person in 0..N_PEOPLE {
        let own: BTreeSet<u64> = ids.iter().filter_map(|ids| ids[person]).collect();
        assert_eq!(own.len(), 1, "person {person} is {own:?}");
        let n_seen = ids.iter().filter(|ids| ids[person].is_some()).count();
        assert!(n_seen > n_frames / 2, "person {person}: {n_seen} frames");
    }
    let used: BTreeSet<u64> = ids.iter().flatten().flatten().copied().collect();
    assert_eq!(used, (1..=N_PEOPLE as u64).collect());
}
