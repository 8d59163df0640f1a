//! GLB (glTF 2.0, binary): a skinned skeleton with its animation; metres, y up.
//!
//! The nodes are the nodes of this crate's tree. Their rotations and positions are the measured ones of every frame, so that joints have
//! the positions of the run and bones have their measured lengths. Every bone has a piece of the skin on a separate node. If an end of the
//! bone was not seen, this node is scaled to zero, because glTF would otherwise interpolate. Standard deviations and gaps of all points are
//! in `extras` of the animation.

mod mesh;
mod store;

use std::io;

use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::points::rate;
use crate::sink::{Notes, Sink};
use crate::tree::{N_NODES, NODES, Poser, anchor, lengths};
use crate::{Point, Trial};
use mesh::Mesh;
use store::Store;

/// Length at rest of a bone that was never seen, in metres.
const UNSEEN_M: f64 = 0.2;
/// Length up to which a bone is not drawn, in metres; shorter bones would cause a division by nearly zero.
const SHORTEST_M: f64 = 1e-4;
/// Size of a keypoint's mark, in metres.
const MARK_M: f64 = 0.02;

/// A piece of the skin, on a separate node.
struct Piece {
    /// Node where the bone ends, or index of the keypoint among the points.
    of: Of,
    name: String,
    /// Node of the file that carries the piece.
    parent: usize,
    /// Pose of the piece at rest, in the frame of its parent node.
    rest: Isometry3<f64>,
    scale: Vector3<f64>,
    /// Pose of the piece at rest, in the scene.
    in_scene: Isometry3<f64>,
}

#[derive(Clone, Copy)]
enum Of {
    Bone(usize),
    Keypoint(usize),
}

/// Writes the file. Its binary part is assembled in memory, about 600 bytes for each frame.
pub(crate) fn write(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    let rate_hz = rate(trial)?;
    let lengths = lengths(trial);
    let rest = places_at_rest(&lengths);
    let mut pieces = bones(&lengths, &rest);
    pieces.extend(keypoints(trial));
    if pieces.is_empty() {
        let why = "GLB: no frame has a bone with both ends, or an extra keypoint";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    }
    let mut store = Store::default();
    let mesh = mesh(&pieces).store(&mut store);
    let skin = skin(&mut store, &rest, &pieces);
    let tracks = Tracks::new(trial, &lengths, &pieces);
    let times: Vec<f32> = (0..trial.slots.len())
        .map(|slot| trial.time_s(slot).unwrap_or(slot as f64 / rate_hz) as f32)
        .collect();
    let animation = tracks.store(&mut store, &times);
    let document = json!({
        "asset": {
            "version": "2.0",
            "generator": format!("Parallax {}", env!("CARGO_PKG_VERSION")),
            "extras": {
                "unit": "m",
                "axes": "y up; x and z are the rig's, turned as for TRC",
                "rate_hz": rate_hz,
                "first_frame": trial.first_frame,
                "frame_step": trial.frame_step,
            },
        },
        "scene": 0,
        "scenes": [{ "name": trial.name, "nodes": [0, skin_node(&pieces)] }],
        "nodes": nodes(trial, &rest, &pieces),
        "skins": [skin],
        "meshes": [mesh],
        "materials": [{
            "name": "body",
            "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.8 },
        }],
        "animations": [{
            "name": trial.name,
            "channels": animation.channels,
            "samplers": animation.samplers,
            "extras": extras(trial),
        }],
        "accessors": store.accessors,
        "bufferViews": store.views,
        "buffers": [{ "byteLength": store.bytes.len() }],
    });
    chunks(out, &document, &store.bytes)?;
    Ok(vec![
        "the joints do not show how a bone turns about its own axis: it turns with its parent"
            .to_owned(),
    ])
}

/// Returns the positions of the nodes of the tree at rest: a T-pose with the feet on the ground.
fn places_at_rest(lengths: &[Option<f64>; N_NODES]) -> [Vector3<f64>; N_NODES] {
    let mut places = [Vector3::zeros(); N_NODES];
    for (index, node) in NODES.iter().enumerate().skip(1) {
        let from = node.parent.map_or_else(Vector3::zeros, |parent| places[parent]);
        places[index] = from + Vector3::from(node.rest) * lengths[index].unwrap_or(UNSEEN_M);
    }
    let lowest = places.iter().map(|place| place.y).fold(0.0, f64::min);
    for place in &mut places {
        place.y -= lowest;
    }
    places
}

/// Returns the index of a node in the file. Node 0 of the file is the person, and the tree follows.
const fn in_file(node: usize) -> usize {
    node + 1
}

fn bones(lengths: &[Option<f64>; N_NODES], rest: &[Vector3<f64>; N_NODES]) -> Vec<Piece> {
    let all = NODES.iter().enumerate().filter_map(|(index, node)| {
        let (length, parent) = (
            lengths[index].filter(|length| *length > SHORTEST_M)?,
            node.parent?,
        );
        let width = (0.25 * length).clamp(0.03, 0.09);
        let along = UnitQuaternion::rotation_between(&Vector3::y(), &node.rest.into());
        let down = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
        let along = along.unwrap_or_else(down);
        Some(Piece {
            of: Of::Bone(index),
            name: format!("{}_bone", node.name),
            parent: in_file(parent),
            rest: Isometry3::from_parts(Vector3::zeros().into(), along),
            scale: Vector3::new(width, length, width),
            in_scene: Isometry3::from_parts(rest[parent].into(), along),
        })
    });
    all.collect()
}

fn keypoints(trial: &Trial) -> Vec<Piece> {
    let world = trial.y_up_from_world();
    let labels = trial.labels();
    let first = trial.joints.joints.len();
    let all = (first..trial.n_points()).filter_map(|point| {
        let mut slots = 0..trial.slots.len();
        let place = slots.find_map(|slot| trial.point(slot, point))?.in_world;
        let rest = Isometry3::from((world * place).coords);
        Some(Piece {
            of: Of::Keypoint(point),
            name: labels[point].clone(),
            parent: 0,
            rest,
            scale: Vector3::repeat(1.0),
            in_scene: rest,
        })
    });
    all.collect()
}

fn mesh(pieces: &[Piece]) -> Mesh {
    let mut mesh = Mesh::default();
    for (nth, piece) in pieces.iter().enumerate() {
        let (name, shape) = match piece.of {
            Of::Bone(node) => (NODES[node].landmark.unwrap_or(""), mesh::BONE.to_vec()),
            Of::Keypoint(_) => (&piece.name[..], mesh::mark(MARK_M)),
        };
        let side = crate::annotate::side_of(name);
        let to_scene = |point: [f64; 3]| {
            piece.in_scene * Point3::from(Vector3::from(point).component_mul(&piece.scale))
        };
        mesh.add(&shape, to_scene, N_NODES + nth, side.colour());
    }
    mesh
}

/// Returns the skin: all nodes of the tree, then the nodes of the pieces.
fn skin(store: &mut Store, rest: &[Vector3<f64>; N_NODES], pieces: &[Piece]) -> Value {
    let of_tree = rest.iter().map(|place| Matrix4::new_translation(&-place));
    let of_pieces = pieces.iter().map(|piece| {
        let shrink = Matrix4::new_nonuniform_scaling(&piece.scale.map(|side| 1.0 / side));
        shrink * piece.in_scene.inverse().to_homogeneous()
    });
    let matrices: Vec<f32> = of_tree
        .chain(of_pieces)
        .flat_map(|matrix| matrix.as_slice().iter().map(|value| *value as f32).collect::<Vec<_>>())
        .collect();
    let joints: Vec<usize> = (0..N_NODES + pieces.len()).map(in_file).collect();
    json!({
        "name": "skeleton",
        "skeleton": 0,
        "joints": joints,
        "inverseBindMatrices": store.reals(&matrices, 16, "MAT4"),
    })
}

/// Returns the index of the node that carries the mesh, after all other nodes.
fn skin_node(pieces: &[Piece]) -> usize {
    in_file(N_NODES + pieces.len())
}

fn nodes(trial: &Trial, rest: &[Vector3<f64>; N_NODES], pieces: &[Piece]) -> Vec<Value> {
    let children = |file_node: usize| -> Vec<usize> {
        let of_tree = NODES
            .iter()
            .enumerate()
            .filter(|node| node.1.parent.map_or(0, in_file) == file_node);
        let of_pieces = pieces.iter().enumerate().filter(|piece| piece.1.parent == file_node);
        let of_pieces = of_pieces.map(|piece| in_file(N_NODES + piece.0));
        of_tree.map(|node| in_file(node.0)).chain(of_pieces).collect()
    };
    let mut nodes = vec![json!({ "name": trial.name, "children": children(0) })];
    for (index, node) in NODES.iter().enumerate() {
        let from = node.parent.map_or_else(Vector3::zeros, |parent| rest[parent]);
        let mut value = json!({ "name": node.name, "translation": real3(rest[index] - from) });
        let children = children(in_file(index));
        if !children.is_empty() {
            value["children"] = json!(children);
        }
        nodes.push(value);
    }
    nodes.extend(pieces.iter().map(|piece| {
        json!({
            "name": piece.name,
            "translation": real3(piece.rest.translation.vector),
            "rotation": real4(&piece.rest.rotation),
            "scale": real3(piece.scale),
        })
    }));
    nodes.push(json!({ "name": "body", "mesh": 0, "skin": 0 }));
    nodes
}

fn real3(it: Vector3<f64>) -> [f32; 3] {
    [it.x as f32, it.y as f32, it.z as f32]
}

fn real4(it: &UnitQuaternion<f64>) -> [f32; 4] {
    [it.i as f32, it.j as f32, it.k as f32, it.w as f32]
}

/// Values that change from frame to frame.
struct Tracks {
    /// Rotations of every node of the tree.
    turns: Vec<Vec<f32>>,
    places: Vec<Vec<f32>>,
    /// Scales of every piece.
    scales: Vec<Vec<f32>>,
    /// Marks of every piece that is a keypoint; empty for other pieces.
    marks: Vec<Vec<f32>>,
}

impl Tracks {
    fn new(trial: &Trial, lengths: &[Option<f64>; N_NODES], pieces: &[Piece]) -> Self {
        let mut tracks = Self {
            turns: vec![Vec::new(); N_NODES],
            places: vec![Vec::new(); N_NODES],
            scales: vec![Vec::new(); pieces.len()],
            marks: vec![Vec::new(); pieces.len()],
        };
        let at_rest = lengths.map(|length| length.or(Some(UNSEEN_M)));
        let mut poser = Poser::new(trial, &at_rest);
        let world = trial.y_up_from_world();
        let mut last = [Quaternion::identity(); N_NODES];
        for slot in 0..trial.slots.len() {
            let posed = poser.pose(slot);
            for (index, last) in last.iter_mut().enumerate() {
                // A quaternion and its negative are the same rotation, but programs interpolate between the numbers.
                let turn = posed.turn[index].quaternion();
                let is_far = turn.dot(last) < 0.0;
                *last = if is_far { -turn } else { *turn };
                tracks.turns[index].extend(real4(&UnitQuaternion::new_unchecked(*last)));
                tracks.places[index].extend(real3(posed.place[index]));
            }
            for (nth, piece) in pieces.iter().enumerate() {
                match piece.of {
                    Of::Bone(node) => {
                        let ends = anchor(node).and_then(|i| posed.seen[i]).zip(posed.seen[node]);
                        let width = piece.scale.x;
                        let scale =
                            ends.map(|(from, to)| Vector3::new(width, (to - from).norm(), width));
                        tracks.scales[nth].extend(real3(scale.unwrap_or_default()));
                    }
                    Of::Keypoint(point) => {
                        let place =
                            trial.point(slot, point).map(|found| (world * found.in_world).coords);
                        let n = tracks.marks[nth].len();
                        let held = tracks.marks[nth].get(n.wrapping_sub(3)..).map(<[f32]>::to_vec);
                        let rest = || real3(piece.rest.translation.vector).to_vec();
                        let place = place.map_or_else(
                            || held.unwrap_or_else(rest),
                            |place| real3(place).to_vec(),
                        );
                        tracks.marks[nth].extend(place);
                        let size = f64::from(u8::from(trial.point(slot, point).is_some()));
                        tracks.scales[nth].extend(real3(Vector3::repeat(size)));
                    }
                }
            }
        }
        tracks
    }

    fn store(&self, store: &mut Store, times: &[f32]) -> Animation {
        let mut animation = Animation {
            times: store.times(times),
            channels: Vec::new(),
            samplers: Vec::new(),
        };
        for (index, node) in NODES.iter().enumerate() {
            if index == 0 || node.aim.is_some() {
                let values = store.reals(&self.turns[index], 4, "VEC4");
                animation.add(in_file(index), "rotation", "LINEAR", values);
            }
            if node.landmark.is_some() {
                let values = store.reals(&self.places[index], 3, "VEC3");
                animation.add(in_file(index), "translation", "LINEAR", values);
            }
        }
        for (nth, scales) in self.scales.iter().enumerate() {
            let node = in_file(N_NODES + nth);
            let values = store.reals(scales, 3, "VEC3");
            animation.add(node, "scale", "STEP", values);
            if !self.marks[nth].is_empty() {
                let values = store.reals(&self.marks[nth], 3, "VEC3");
                animation.add(node, "translation", "LINEAR", values);
            }
        }
        animation
    }
}

struct Animation {
    times: usize,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Animation {
    fn add(&mut self, node: usize, path: &str, interpolation: &str, values: usize) {
        let sampler = self.samplers.len();
        self.channels
            .push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
        let times = self.times;
        self.samplers
            .push(json!({ "input": times, "output": values, "interpolation": interpolation }));
    }
}

/// Returns the standard deviations, in metres, one for each frame, and the gaps, each as the numbers of its first and last frame.
fn extras(trial: &Trial) -> Value {
    let of_point = |(nth, label): (usize, String)| {
        let deviations: Vec<Option<f64>> = (0..trial.slots.len())
            .map(|slot| trial.point(slot, nth).and_then(Point::deviation_m))
            .map(|deviation| deviation.map(|value| (value * 1e5).round() / 1e5))
            .collect();
        let value = json!({ "standard_deviation_m": deviations, "gaps": trial.gaps(nth), "filled": trial.filled(nth) });
        (label, value)
    };
    let points: serde_json::Map<String, Value> =
        trial.labels().into_iter().enumerate().map(of_point).collect();
    json!({ "points": points })
}

/// Writes the container: a head, the document, the binary part.
fn chunks(out: &mut Sink<'_>, document: &Value, binary: &[u8]) -> io::Result<()> {
    let mut text = serde_json::to_vec(document)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let padding = binary.len().next_multiple_of(4) - binary.len();
    let length = 12 + 8 + text.len() + 8 + binary.len() + padding;
    let size = |length: usize| {
        u32::try_from(length)
            .map_err(|_error| io::Error::other("GLB has no room for more than 4 GB"))
    };
    out.write_all(b"glTF")?;
    for word in [2, size(length)?, size(text.len())?] {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(&text)?;
    out.write_all(&size(binary.len() + padding)?.to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    out.write_all(binary)?;
    out.write_all(&vec![0; padding])
}

#[cfg(test)]
mod tests;
