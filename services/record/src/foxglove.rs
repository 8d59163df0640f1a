//! Messages in Foxglove's own message types, as JSON, which are recorded in addition to Parallax's messages. With them, Foxglove can show a
//! recording directly.
//!
//! The schemas (`foxglove/`) are those of `@foxglove/schemas` 2.1.0, without descriptions (MIT licence).

use std::collections::BTreeSet;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use bytemuck::pod_read_unaligned;
use geometry::{Camera, LensModel};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use messages::{FrameHeader, Joint3d, SkeletonMessage, Skeletons, Status};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use recording::{Foreign, Kind, Message};
use serde_json::{Value, json};
use skeleton::JointSet;

/// Quality of the JPEG files, in percent.
const QUALITY: u8 = 75;
/// Frame of reference of the skeleton.
const WORLD: &str = "world";
/// Diameter of a joint, in metres.
const JOINT_M: f64 = 0.04;
/// Width of a line between joints, in metres.
const LINE_M: f64 = 0.02;
/// Radius, in standard deviations, of the ellipsoid that contains a 3D point with a probability of 95 %.
const SPREAD: f64 = 2.796;
/// Maximum size of an ellipsoid, in metres. Larger ellipsoids would hide everything.
const LARGEST_M: f64 = 2.0;

/// The cameras and joints of a run.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Cameras with the intrinsics of their frames (not of the original footage), in the order of views.
    pub cameras: Vec<Camera>,
    /// Joints of the result.
    pub joints: &'static JointSet,
}

/// Creates messages for Foxglove from Parallax's messages.
#[derive(Debug)]
pub(crate) struct Foxglove {
    stage: Stage,
    /// True if the poses of the cameras have been written.
    is_begun: bool,
    /// People who were present in the previous frame.
    shown: BTreeSet<u64>,
}

/// Index of the topic with the scene. It is followed by a calibration topic and a picture topic for every view.
const SCENE: usize = 0;
const TRANSFORMS: usize = 1;
const VIEWS: usize = 2;

impl Foxglove {
    pub(crate) fn new(stage: Stage) -> Self {
        Self {
            stage,
            is_begun: false,
            shown: BTreeSet::new(),
        }
    }

    /// Returns the topics. Messages refer to them by their index in this list.
    pub(crate) fn topics(&self) -> Vec<Foreign> {
        let topic = |topic: String, schema_name, schema| Foreign {
            topic,
            schema_name,
            schema,
        };
        let mut topics = vec![
            topic(
                "/skeleton".to_owned(),
                "foxglove.SceneUpdate",
                include_str!("../foxglove/SceneUpdate.json").trim_ascii(),
            ),
            topic(
                "/tf".to_owned(),
                "foxglove.FrameTransforms",
                include_str!("../foxglove/FrameTransforms.json").trim_ascii(),
            ),
        ];
        for camera in &self.stage.cameras {
            topics.push(topic(
                format!("/{}/calibration", camera.name),
                "foxglove.CameraCalibration",
                include_str!("../foxglove/CameraCalibration.json").trim_ascii(),
            ));
            topics.push(topic(
                format!("/{}/image", camera.name),
                "foxglove.CompressedImage",
                include_str!("../foxglove/CompressedImage.json").trim_ascii(),
            ));
        }
        topics
    }

    /// Returns the Foxglove messages for one of Parallax's messages, each with the index of its topic. Messages about the cameras come
    /// before the first message.
    ///
    /// * `data`: the message as written to the recording.
    pub(crate) fn messages(&mut self, kind: Kind, data: &[u8]) -> Vec<(usize, String)> {
        let Ok(message) = Message::parse(kind, data) else {
            return Vec::new();
        };
        let (time, made) = match kind {
            Kind::Skeletons => {
                let Some(frame) = message.skeletons() else {
                    return Vec::new();
                };
                let time = timestamp(frame.stamp.captured_at_nanos);
                let is_frame = frame.status != Status::END;
                let made = is_frame.then(|| (SCENE, self.scene(&frame, &time)));
                (time, made)
            }
            Kind::Frame => {
                let head: FrameHeader = pod_read_unaligned(message.head);
                let time = timestamp(head.stamp.captured_at_nanos);
                let made = self.image(&head, message.elements, &time);
                (time, made)
            }
            _ => return Vec::new(),
        };
        let Some((topic, value)) = made else {
            return Vec::new();
        };
        let mut all = Vec::new();
        if !self.is_begun {
            self.is_begun = true;
            all = self.cameras(&time);
        }
        all.push((topic, value));
        let text = |(topic, value): (usize, Value)| (topic, value.to_string());
        all.into_iter().map(text).collect()
    }

    /// Returns messages with the poses and intrinsics of the cameras.
    fn cameras(&self, time: &Value) -> Vec<(usize, Value)> {
        let transform = |camera: &Camera| {
            let world_from_camera = camera.camera_from_world.inverse();
            json!({
                "timestamp": time, "parent_frame_id": WORLD, "child_frame_id": camera.name,
                "translation": vector(world_from_camera.translation.vector.into()),
                "rotation": quaternion(&world_from_camera.rotation),
            })
        };
        let transforms: Vec<Value> = self.stage.cameras.iter().map(transform).collect();
        let mut all = vec![(TRANSFORMS, json!({ "transforms": transforms }))];
        let calibrations = self.stage.cameras.iter().enumerate();
        all.extend(
            calibrations.map(|(view, camera)| (VIEWS + 2 * view, calibration(camera, time))),
        );
        all
    }

    fn image(&self, head: &FrameHeader, rgb: &[u8], time: &Value) -> Option<(usize, Value)> {
        let view = head.stamp.view as usize;
        let camera = self.stage.cameras.get(view)?;
        let n_bytes = (head.width as usize).checked_mul(head.height as usize)?;
        let fits = n_bytes.checked_mul(3)? == rgb.len() && !rgb.is_empty();
        if head.status != Status::OK || !fits {
            return None;
        }
        let mut jpeg = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, QUALITY);
        let encoded = encoder.encode(rgb, head.width, head.height, ExtendedColorType::Rgb8);
        encoded.ok()?;
        let message = json!({
            "timestamp": time, "frame_id": camera.name, "format": "jpeg", "data": STANDARD.encode(&jpeg),
        });
        Some((VIEWS + 2 * view + 1, message))
    }

    /// Returns the people in a frame, one entity per person, named by the person's number. People who are no longer present are removed.
    fn scene(&mut self, frame: &Skeletons, time: &Value) -> Value {
        let people = frame.listed().iter();
        let people = people.filter(|person| person.status == Status::OK);
        let people: Vec<&SkeletonMessage> = people.collect();
        let entities: Vec<Value> = people
            .iter()
            .map(|person| self.entity(person, frame.stamp.frame, time))
            .collect();
        let now: BTreeSet<u64> = people.iter().map(|person| person.id).collect();
        let gone = self.shown.difference(&now);
        let gone = gone.map(|id| json!({ "timestamp": time, "type": 0, "id": entity_id(*id) }));
        let gone: Vec<Value> = gone.collect();
        self.shown = now;
        json!({ "deletions": gone, "entities": entities })
    }

    fn entity(&self, person: &SkeletonMessage, frame: u64, time: &Value) -> Value {
        let found = |joint3d: &Joint3d| {
            let is_finite = joint3d
                .in_world
                .iter()
                .chain(&joint3d.covariance)
                .all(|value| value.is_finite());
            joint3d.status == Status::OK && is_finite
        };
        let joints = person.listed_joints().iter();
        let joints: Vec<Option<&Joint3d>> =
            joints.map(|joint| Some(joint).filter(|joint| found(joint))).collect();
        let names = self.stage.joints.joints.iter().map(|joint| joint.name);
        let named = joints.iter().zip(names);
        let named = named.filter_map(|(joint, name)| Some(((*joint)?, name)));
        let mut spheres = Vec::new();
        for (joint, name) in named {
            let pose = posed(joint.in_world, &UnitQuaternion::identity());
            spheres.push(sphere(&pose, [JOINT_M; 3], &colour(name, 1.0)));
            spheres.extend(ellipsoid(joint));
        }
        let (mut points, mut colours) = (Vec::new(), Vec::new());
        for &(from, to) in self.stage.joints.limbs {
            let ends = [from, to].map(|i| joints.get(i).copied().flatten());
            let [Some(from_joint), Some(to_joint)] = ends else {
                continue;
            };
            let names = [from, to].map(|i| self.stage.joints.joints[i].name);
            let side = names.into_iter().find(|name| is_sided(name)).unwrap_or("");
            for joint in [from_joint, to_joint] {
                points.push(vector(joint.in_world));
                colours.push(colour(side, 1.0));
            }
        }
        let origin = posed([0.0; 3], &UnitQuaternion::identity());
        let lines = json!({
            "type": 2, "pose": origin, "thickness": LINE_M, "scale_invariant": false, "points": points,
            "color": colour("", 1.0), "colors": colours, "indices": [],
        });
        json!({
            "timestamp": time, "frame_id": WORLD, "id": entity_id(person.id), "lifetime": { "sec": 0, "nsec": 0 },
            "frame_locked": true,
            "metadata": [{ "key": "frame", "value": frame.to_string() }],
            "arrows": [], "cubes": [], "spheres": spheres, "cylinders": [], "lines": [lines],
            "triangles": [], "texts": [], "models": [],
        })
    }
}

fn entity_id(person: u64) -> String {
    format!("person {person}")
}

fn calibration(camera: &Camera, time: &Value) -> Value {
    let it = &camera.intrinsics;
    let (model, coefficients) = match it.lens.model() {
        LensModel::Pinhole => ("plumb_bob", vec![0.0; 5]),
        LensModel::BrownConrady { k, p } => (
            "rational_polynomial",
            vec![k[0], k[1], p[0], p[1], k[2], k[3], k[4], k[5]],
        ),
        LensModel::KannalaBrandt { k } => ("kannala_brandt", k.to_vec()),
    };
    json!({
        "timestamp": time, "frame_id": camera.name, "width": it.size[0], "height": it.size[1],
        "distortion_model": model, "D": coefficients,
        "K": [it.fx, 0.0, it.cx, 0.0, it.fy, it.cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [it.fx, 0.0, it.cx, 0.0, 0.0, it.fy, it.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    })
}

/// Returns the ellipsoid that contains a joint with a probability of 95 %. Returns `None` if it is unknown or unbounded.
fn ellipsoid(joint: &Joint3d) -> Option<Value> {
    let [xx, xy, xz, yy, yz, zz] = joint.covariance;
    let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let eigen = covariance.symmetric_eigen();
    let diameters = eigen.eigenvalues.map(|eigenvalue| 2.0 * SPREAD * eigenvalue.max(0.0).sqrt());
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    let is_sane = diameters.iter().all(|diameter| diameter.is_finite() && *diameter <= LARGEST_M);
    if !is_sane || diameters.max() <= 0.0 {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let pose = posed(joint.in_world, &rotation);
    Some(sphere(
        &pose,
        diameters.into(),
        &rgba([0.78, 0.82, 0.87], 0.25),
    ))
}

fn sphere(pose: &Value, size: [f64; 3], colour: &Value) -> Value {
    json!({ "pose": pose, "size": vector(size), "color": colour })
}

fn posed(at: [f64; 3], rotation: &UnitQuaternion<f64>) -> Value {
    json!({ "position": vector(at), "orientation": quaternion(rotation) })
}

fn vector([x, y, z]: [f64; 3]) -> Value {
    json!({ "x": x, "y": y, "z": z })
}

fn quaternion(it: &UnitQuaternion<f64>) -> Value {
    json!({ "x": it.i, "y": it.j, "z": it.k, "w": it.w })
}

fn is_sided(name: &str) -> bool {
    name.starts_with("right") || name.starts_with("left")
}

/// Returns the colour of a joint or limb by the side of the body in its name. Reports use the same colours.
fn colour(name: &str, alpha: f64) -> Value {
    let rgb = if name.starts_with("right") {
        [0.90, 0.62, 0.0]
    } else if name.starts_with("left") {
        [0.34, 0.71, 0.91]
    } else {
        [0.27, 0.79, 0.71]
    };
    rgba(rgb, alpha)
}

fn rgba([r, g, b]: [f64; 3], alpha: f64) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": alpha })
}

fn timestamp(nanos: u64) -> Value {
    json!({ "sec": nanos / 1_000_000_000, "nsec": nanos % 1_000_000_000 })
}

#[cfg(test)]
mod tests;
