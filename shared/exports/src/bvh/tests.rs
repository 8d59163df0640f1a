//! Tests with a separate reader of the files, and its forward kinematics.

use nalgebra::{Point3, Rotation3};

use super::*;
use crate::Gap;
use crate::landmarks::Landmarks;
use crate::testing::walker;

/// A joint of a BVH file, as readers of the format see it.
struct Joint {
    name: String,
    parent: Option<usize>,
    offset: Vector3<f64>,
    n_channels: usize,
}

/// Reads a file independently of the writer: the joints, and the numbers of every frame.
fn read(text: &str) -> (Vec<Joint>, Vec<Vec<f64>>) {
    let (mut joints, mut open): (Vec<Joint>, Vec<usize>) = (Vec::new(), Vec::new());
    let mut lines = text.lines().map(str::trim);
    let numbers = |text: &str| -> Vec<f64> {
        text.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    for line in lines.by_ref() {
        match line.split_whitespace().next() {
            Some("ROOT" | "JOINT" | "End") => {
                let name = line.split_whitespace().nth(1).unwrap().to_owned();
                let parent = open.last().copied();
                open.push(joints.len());
                joints.push(Joint {
                    name,
                    parent,
                    offset: Vector3::zeros(),
                    n_channels: 0,
                });
            }
            Some("OFFSET") => {
                joints.last_mut().unwrap().offset = Vector3::from_vec(numbers(line));
            }
            Some("CHANNELS") => joints.last_mut().unwrap().n_channels = numbers(line)[0] as usize,
            Some("}") => drop(open.pop()),
            Some("MOTION") => break,
            _ => {}
        }
    }
    let frames = lines.skip(2).map(numbers).collect();
    (joints, frames)
}

/// Returns the positions of all joints by forward kinematics, in centimetres.
fn places(joints: &[Joint], frame: &[f64]) -> Vec<Point3<f64>> {
    let mut values = frame.iter().copied();
    let mut next = || values.next().unwrap();
    let mut all: Vec<(Rotation3<f64>, Point3<f64>)> = Vec::new();
    for joint in joints {
        let (turn, place) =
            joint.parent.map_or((Rotation3::identity(), Point3::origin()), |parent| {
                all[parent]
            });
        let mut place = place + turn * joint.offset;
        if joint.n_channels == 6 {
            place += Vector3::new(next(), next(), next());
        }
        let mut own = Rotation3::identity();
        if joint.n_channels > 0 {
            for axis in [Vector3::z_axis(), Vector3::x_axis(), Vector3::y_axis()] {
                own *= Rotation3::from_axis_angle(&axis, next().to_radians());
            }
        }
        all.push((turn * own, place));
    }
    all.into_iter().map(|node| node.1).collect()
}

fn written(trial: &Trial) -> (String, Notes) {
    let mut bytes = Vec::new();
    let notes = write(trial, &mut bytes).unwrap();
    (String::from_utf8(bytes).unwrap(), notes)
}

/// Returns the maximum distance of a joint from its measured position: the sum of the length changes of the bones between the hips and the
/// joint.
fn bound(trial: &Trial, slot: usize, node: usize) -> f64 {
    let (lengths, landmarks) = (lengths(trial), Landmarks::of(trial));
    let place = |node: usize| landmarks.at(trial, slot, NODES[node].landmark.unwrap());
    let (mut sum, mut node) = (0.0, node);
    while let Some(from) = crate::tree::anchor(node) {
        let length = (place(node).unwrap() - place(from).unwrap()).norm();
        sum += (length - lengths[node].unwrap()).abs();
        node = from;
    }
    sum
}

#[test]
fn forward_kinematics_gives_the_joints_within_the_variation_of_bone_length() {
    let mut trial = walker(60);
    // The bones change their lengths: every joint is moved by up to 3 cm.
    for (slot, content) in trial.slots.iter_mut().enumerate() {
        for (nth, point) in content.points.iter_mut().flatten().enumerate() {
            let phase = (slot * 7 + nth * 13) as f64;
            point.in_world += Vector3::new(phase.sin(), phase.cos(), (2.0 * phase).sin()) * 0.03;
        }
    }
    let (text, _) = written(&trial);
    let (joints, frames) = read(&text);
    assert_eq!(frames.len(), 60);
    let landmarks = Landmarks::of(&trial);
    let world = trial.y_up_from_world();
    // Ends have no names; the joints are in the order of the tree.
    assert_eq!(joints.len(), N_NODES);
    let mut worst: f64 = 0.0;
    for (slot, frame) in frames.iter().enumerate() {
        let places = places(&joints, frame);
        for (index, node) in NODES.iter().enumerate() {
            let Some(landmark) = node.landmark else {
                continue;
            };
            assert!(["Site", node.name].contains(&&*joints[index].name));
            let due = world * landmarks.at(&trial, slot, landmark).unwrap();
            let off = (places[index] / CM - due).norm();
            let bound = bound(&trial, slot, index);
            assert!(
                off < bound + 1e-5,
                "{landmark} of {slot}: {off} m, bound {bound} m"
            );
            worst = worst.max(off);
        }
    }
    assert!(worst > 0.01, "the lengths do change: {worst}");
}

#[test]
fn joints_with_constant_bone_lengths_are_reproduced_exactly() {
    let trial = walker(1);
    let (joints, frames) = read(&written(&trial).0);
    let landmarks = Landmarks::of(&trial);
    let places = places(&joints, &frames[0]);
    for (index, node) in NODES.iter().enumerate() {
        let Some(landmark) = node.landmark else {
            continue;
        };
        let due = trial.y_up_from_world() * landmarks.at(&trial, 0, landmark).unwrap();
        assert!((places[index] / CM - due).norm() < 1e-6, "{landmark}");
    }
}

#[test]
fn held_and_omitted_frames_are_reported() {
    let mut trial = walker(10);
    trial.slots[4].points.clear();
    trial.slots[5].points[0] = Err(Gap("implausible".into()));
    for slot in &mut trial.slots {
        if let Some(head) = slot.points.last_mut() {
            *head = Err(Gap("too few views".into()));
        }
    }
    let (text, notes) = written(&trial);
    let (joints, frames) = read(&text);
    assert_eq!(joints.len(), N_NODES - 2, "without the head");
    assert_eq!(frames[4], frames[3]);
    let notes = notes.join("\n");
    assert!(notes.contains("in 2 of 10 frames (1 of them"), "{notes}");
    assert!(notes.contains("frames 14-15"), "{notes}");
    assert!(notes.contains("their parent joint: head"), "{notes}");
}

#[test]
fn without_hips_no_skeleton_is_written() {
    let mut trial = walker(2);
    for slot in &mut trial.slots {
        slot.points[2] = Err(Gap("too few views".into()));
    }
    let error = write(&trial, &mut Vec::new()).unwrap_err();
    assert!(error.to_string().contains("hips"), "{error}");
}

#[test]
fn angles_continue_beyond_half_a_turn() {
    let mut last = [0.0; 3];
    for step in 0..100 {
        let angle = 0.1 * f64::from(step);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        last = unwrapped(zxy(&turn), last);
        assert!((last[2] - angle).abs() < 1e-9, "{angle}: {last:?}");
    }
}
