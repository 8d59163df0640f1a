//! Parses the files, and checks the positions of their nodes and skin.

use nalgebra::Vector4;

use super::*;
use crate::Gap;
use crate::landmarks::Landmarks;
use crate::testing::walker;

/// A file that was parsed according to the specification.
struct Read {
    json: Value,
    binary: Vec<u8>,
}

impl Read {
    fn new(trial: &Trial) -> Self {
        let mut file = Vec::new();
        write(trial, &mut file).unwrap();
        let word = |at: usize| u32::from_le_bytes(*file[at..].first_chunk().unwrap()) as usize;
        assert_eq!(
            (&file[..4], word(4), word(8)),
            (&b"glTF"[..], 2, file.len())
        );
        let n = word(12);
        assert_eq!(
            (&file[16..20], &file[24 + n..28 + n]),
            (&b"JSON"[..], &b"BIN\0"[..])
        );
        assert_eq!(28 + n + word(20 + n), file.len());
        Self {
            json: serde_json::from_slice(&file[20..20 + n]).unwrap(),
            binary: file[28 + n..].to_vec(),
        }
    }

    fn reals(&self, accessor: &Value) -> Vec<f64> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [at, n] =
            ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
        let bytes = self.binary[at..at + n].as_chunks().0;
        bytes.iter().map(|byte| f64::from(f32::from_le_bytes(*byte))).collect()
    }

    /// Returns the value of a node in a frame: its animated value, otherwise its own.
    fn value(&self, node: usize, path: &str, frame: usize, default: &[f64]) -> Vec<f64> {
        let animation = &self.json["animations"][0];
        let channels = animation["channels"].as_array().unwrap();
        let own = channels
            .iter()
            .find(|channel| channel["target"]["node"] == node && channel["target"]["path"] == path);
        if let Some(channel) = own {
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let all = self.reals(&sampler["output"]);
            return all[frame * default.len()..(frame + 1) * default.len()].to_vec();
        }
        let own = self.json["nodes"][node][path].as_array();
        own.map_or(default.to_vec(), |values| {
            values.iter().map(|value| value.as_f64().unwrap()).collect()
        })
    }

    fn local(&self, node: usize, frame: usize) -> Matrix4<f64> {
        let place = self.value(node, "translation", frame, &[0.0; 3]);
        let turn = self.value(node, "rotation", frame, &[0.0, 0.0, 0.0, 1.0]);
        let scale = self.value(node, "scale", frame, &[1.0; 3]);
        let turn = Quaternion::from_vector(Vector4::from_vec(turn));
        assert!((turn.norm() - 1.0).abs() < 1e-6);
        Matrix4::new_translation(&Vector3::from_vec(place))
            * UnitQuaternion::new_unchecked(turn).to_homogeneous()
            * Matrix4::new_nonuniform_scaling(&Vector3::from_vec(scale))
    }

    /// Returns the position and orientation of every node in a frame.
    fn globals(&self, frame: usize) -> Vec<Matrix4<f64>> {
        let nodes = self.json["nodes"].as_array().unwrap();
        let mut globals = vec![Matrix4::identity(); nodes.len()];
        let mut open = vec![(0, Matrix4::identity())];
        while let Some((node, parent)) = open.pop() {
            globals[node] = parent * self.local(node, frame);
            let children = nodes[node]["children"].as_array();
            for child in children.into_iter().flatten() {
                open.push((child.as_u64().unwrap() as usize, globals[node]));
            }
        }
        globals
    }

    fn node(&self, name: &str) -> usize {
        let nodes = self.json["nodes"].as_array().unwrap();
        nodes.iter().position(|node| node["name"] == name).unwrap()
    }
}

fn place(matrix: &Matrix4<f64>) -> Point3<f64> {
    Point3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)])
}

#[test]
fn the_nodes_are_at_the_measured_joints() {
    let trial = walker(30);
    let read = Read::new(&trial);
    let landmarks = Landmarks::of(&trial);
    for frame in [0, 7, 29] {
        let globals = read.globals(frame);
        for node in NODES.iter().filter(|node| node.landmark.is_some()) {
            let due = landmarks.at(&trial, frame, node.landmark.unwrap()).unwrap();
            let off =
                (place(&globals[read.node(node.name)]) - trial.y_up_from_world() * due).norm();
            assert!(off < 1e-5, "{} of {frame}: {off} m", node.name);
        }
    }
    let times = &read.json["animations"][0]["samplers"][0]["input"];
    assert!((read.reals(times)[3] - 13.0 / 30.0).abs() < 1e-6);
}

#[test]
fn the_skin_connects_the_joints_and_is_hidden_in_a_gap() {
    let mut trial = walker(3);
    trial.slots[1].points[0] = Err(Gap("implausible".into()));
    trial.slots[2].points.clear();
    let read = Read::new(&trial);
    let skin = &read.json["skins"][0];
    let joints = skin["joints"].as_array().unwrap();
    let bind = read.reals(&skin["inverseBindMatrices"]);
    let primitive = &read.json["meshes"][0]["primitives"][0]["attributes"];
    let places = read.reals(&primitive["POSITION"]);
    let joint = joints.iter().position(|joint| *joint == read.node("right_ankle_bone")).unwrap();
    // Each piece has eight faces of three vertices, and the first vertex is the tip.
    let first = (joint - N_NODES) * 24;
    let tip = |frame: usize, vertex: usize| {
        let at = 3 * (first + vertex);
        let at_rest = Point3::new(places[at], places[at + 1], places[at + 2]);
        let bind = Matrix4::from_column_slice(&bind[16 * joint..16 * joint + 16]);
        let node = joints[joint].as_u64().unwrap() as usize;
        (read.globals(frame)[node] * bind).transform_point(&at_rest)
    };
    let world = trial.y_up_from_world();
    let ankle = world * trial.point(0, 0).unwrap().in_world;
    let knee = world * trial.point(0, 1).unwrap().in_world;
    assert!((tip(0, 0) - ankle).norm() < 1e-5);
    assert!((tip(0, 12) - knee).norm() < 1e-5);
    for frame in [1, 2] {
        assert!(
            (tip(frame, 0) - tip(frame, 1)).norm() < 1e-9,
            "nothing is left of it"
        );
    }
    let extras = &read.json["animations"][0]["extras"]["points"]["right_ankle"];
    assert_eq!(extras["gaps"], json!([[11, 12]]));
    assert_eq!(extras["standard_deviation_m"][0], 0.03);
    assert_eq!(extras["standard_deviation_m"][1], Value::Null);
}

#[test]
fn extra_keypoints_have_separate_marks() {
    let mut trial = walker(3);
    trial.extras.push("nose".to_owned());
    for slot in &mut trial.slots {
        let head = slot.points[13].clone();
        slot.points.push(head);
    }
    trial.slots[1].points[14] = Err(Gap("".into()));
    let read = Read::new(&trial);
    let nose = read.node("nose");
    let due = trial.y_up_from_world() * trial.point(2, 14).unwrap().in_world;
    assert!((place(&read.globals(2)[nose]) - due).norm() < 1e-5);
    let scale = |frame| read.value(nose, "scale", frame, &[1.0; 3]);
    assert_eq!((scale(0), scale(1)), (vec![1.0; 3], vec![0.0; 3]));
}

#[test]
fn bones_whose_ends_coincide_are_left_out_and_all_numbers_are_finite() {
    let mut trial = walker(3);
    for slot in &mut trial.slots {
        slot.points[0] = slot.points[1].clone();
    }
    let read = Read::new(&trial);
    let nodes = read.json["nodes"].as_array().unwrap();
    let has = |name: &str| nodes.iter().any(|node| node["name"] == name);
    assert!(!has("right_ankle_bone") && has("left_ankle_bone"));
    let bind = read.reals(&read.json["skins"][0]["inverseBindMatrices"]);
    assert!(bind.iter().all(|value| value.is_finite()));
    let samplers = read.json["animations"][0]["samplers"].as_array().unwrap();
    for sampler in samplers {
        let values = read.reals(&sampler["output"]);
        assert!(values.iter().all(|value| value.is_finite()));
    }
}
