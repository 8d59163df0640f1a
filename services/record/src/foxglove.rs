//! What Foxglove shows of a recording as it is: its own message types as JSON, beside ours.
//!
//! The schemas (`foxglove/`) are those of Foxglove, of `@foxglove/schemas` 2.1.0 without descriptions (MIT licence).

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

/// Quality of the JPEG files, percent.
const QUALITY: u8 = 75;
/// The frame of reference of the skeleton.
const WORLD: &str = "world";
/// Diameter of a joint, metres.
const JOINT_M: f64 = 0.04;
/// Width of a line between joints, metres.
const LINE_M: f64 = 0.02;
/// Standard deviations within which a point in space lies with 95 %.
const SPREAD: f64 = 2.796;
/// Largest ellipsoid, metres; larger ones would hide everything.
const LARGEST_M: f64 = 2.0;

/// The cameras and joints of a run.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The cameras as their frames show the world, in the order of views.
    pub cameras: Vec<Camera>,
    /// The joints of the result.
    pub joints: &'static JointSet,
}

/// Makes messages of Foxglove from ours.
#[derive(Debug)]
pub(crate) struct Foxglove {
    stage: Stage,
    /// Whether it has been said where the cameras are.
    is_begun: bool,
    /// The people that were there in the frame before.
    shown: BTreeSet<u64>,
}

/// Numbers of its topics; a calibration and a picture of every view follow.
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

    /// Its topics; messages name them by their place here.
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

    /// The messages that follow from one of ours, with the numbers of their topics. Before the first stand those about the
    /// cameras.
    ///
    /// * `data`: as it is written into the recording.
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

    /// Where the cameras are, and how they see.
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
        all.extend(calibrations.map(|(view, it)| (VIEWS + 2 * view, calibration(it, time))));
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

    /// Everybody in a frame, each an entity of the person's number; who is no longer there is taken away.
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
        let found = |it: &Joint3d| {
            let is_finite = it
                .in_world
                .iter()
                .chain(&it.covariance)
                .all(|it| it.is_finite());
            it.status == Status::OK && is_finite
        };
        let joints = person.listed_joints().iter();
        let joints: Vec<Option<&Joint3d>> =
            joints.map(|it| Some(it).filter(|it| found(it))).collect();
        let names = self.stage.joints.joints.iter().map(|it| it.name);
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
            let ends = [from, to].map(|it| joints.get(it).copied().flatten());
            let [Some(from_joint), Some(to_joint)] = ends else {
                continue;
            };
            let names = [from, to].map(|it| self.stage.joints.joints[it].name);
            let side = names.into_iter().find(|it| is_sided(it)).unwrap_or("");
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

/// Where a joint lies with 95 %; none where that is not known, or everywhere.
fn ellipsoid(joint: &Joint3d) -> Option<Value> {
    let [xx, xy, xz, yy, yz, zz] = joint.covariance;
    let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let eigen = covariance.symmetric_eigen();
    let diameters = eigen
        .eigenvalues
        .map(|it| 2.0 * SPREAD * it.max(0.0).sqrt());
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    let is_sane = diameters
        .iter()
        .all(|it| it.is_finite() && *it <= LARGEST_M);
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

/// The colour of a side of the body, as in reports.
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
mod tests {
    use bytemuck::bytes_of;
    use geometry::{Intrinsics, Lens};
    use nalgebra::{Isometry3, Vector3};
    use recording::encode;
    use skeleton::PARSE14;

    use super::*;

    fn camera(model: LensModel) -> Camera {
        Camera {
            name: "left".to_owned(),
            intrinsics: Intrinsics {
                fx: 300.0,
                fy: 310.0,
                cx: 3.5,
                cy: 2.5,
                size: [8, 6],
                lens: Lens::new(model),
            },
            camera_from_world: Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::x()),
        }
    }

    fn foxglove() -> Foxglove {
        Foxglove::new(Stage {
            cameras: vec![
                camera(LensModel::Pinhole),
                camera(LensModel::KannalaBrandt { k: [0.1; 4] }),
            ],
            joints: &PARSE14,
        })
    }

    /// A frame with one person.
    fn one(id: u64) -> Box<Skeletons> {
        let mut frame = Box::<Skeletons>::default();
        frame.n_people = 1;
        let pose = &mut frame.people[0];
        pose.id = id;
        pose.n_joints = PARSE14.joints.len() as u32;
        for (nth, joint) in pose.joints[..PARSE14.joints.len()].iter_mut().enumerate() {
            joint.in_world = [0.1 * nth as f64, 1.0, 2.0];
            joint.covariance = [4e-4, 1e-4, 0.0, 2e-4, 0.0, 1e-4];
        }
        pose.joints[2].status = Status::IMPLAUSIBLE;
        pose.joints[3].covariance[0] = f64::NAN;
        frame
    }

    /// What a frame becomes.
    fn shown(foxglove: &mut Foxglove, frame: &Skeletons) -> Vec<(usize, Value)> {
        let [head, people] = recording::split(frame);
        made(foxglove, Kind::Skeletons, head, people)
    }

    /// What a message of ours becomes.
    fn made(
        foxglove: &mut Foxglove,
        kind: Kind,
        head: &[u8],
        elements: &[u8],
    ) -> Vec<(usize, Value)> {
        let mut data = Vec::new();
        encode(kind, head, elements, &mut data);
        let made = foxglove.messages(kind, &data).into_iter();
        made.map(|(topic, text)| (topic, serde_json::from_str(&text).unwrap()))
            .collect()
    }

    /// Why a value is not as a schema says: types, and what is required.
    fn problem(schema: &Value, value: &Value) -> Option<String> {
        let fits = match schema["type"].as_str() {
            Some("object") => value.is_object(),
            Some("array") => value.is_array(),
            Some("string") => value.is_string(),
            Some("number") => value.is_number(),
            Some("integer") => value.is_u64() || value.is_i64(),
            Some("boolean") => value.is_boolean(),
            _ => true,
        };
        if !fits {
            return Some(format!("{value} is no {}", schema["type"]));
        }
        for name in schema["required"].as_array().into_iter().flatten() {
            if value.get(name.as_str()?).is_none() {
                return Some(format!("{name} is missing in {value}"));
            }
        }
        let limits = [("minItems", false), ("maxItems", true)];
        let n = value.as_array().map_or(0, Vec::len) as u64;
        for (name, is_most) in limits {
            if let Some(limit) = schema[name].as_u64()
                && (n < limit && !is_most || n > limit && is_most)
            {
                return Some(format!("{n} items, {name} {limit}"));
            }
        }
        let fields = value.as_object().into_iter().flatten();
        let mut inner = fields.map(|(name, value)| (&schema["properties"][name], value));
        let items = value.as_array().into_iter().flatten();
        let mut items = items.map(|value| (&schema["items"], value));
        let found = inner.find_map(|(schema, value)| {
            if schema.is_null() {
                return Some(format!("{value} is no field"));
            }
            problem(schema, value)
        });
        found.or_else(|| items.find_map(|(schema, value)| problem(schema, value)))
    }

    #[test]
    fn messages_are_as_the_schemas_of_foxglove_say_and_the_cameras_come_first() {
        let mut foxglove = foxglove();
        let topics = foxglove.topics();
        let mut two = one(1);
        (two.n_people, two.people[1]) = (2, one(7).people[0]);
        let mut all = shown(&mut foxglove, &two);
        let order: Vec<usize> = all.iter().map(|it| it.0).collect();
        assert_eq!(order, [1, 2, 4, 0]);
        let head = FrameHeader {
            width: 8,
            height: 6,
            stamp: messages::Stamp {
                view: 1,
                ..Default::default()
            },
            ..FrameHeader::default()
        };
        all.extend(made(
            &mut foxglove,
            Kind::Frame,
            bytes_of(&head),
            &[7; 8 * 6 * 3],
        ));
        let mut lost = one(7);
        (lost.n_people, lost.status) = (0, Status::TOO_FEW_VIEWS);
        all.extend(shown(&mut foxglove, &lost));
        assert_eq!(all.len(), 6);
        for (topic, value) in &all {
            let schema = serde_json::from_str(topics[*topic].schema).unwrap();
            assert_eq!(problem(&schema, value), None, "{}", topics[*topic].topic);
        }
        let (image, deleted) = (&all[4], &all[5].1);
        assert_eq!((image.0, image.1["format"].as_str()), (5, Some("jpeg")));
        assert_eq!(all[3].1["entities"][1]["id"], "person 7");
        let gone = [0, 1].map(|nth| deleted["deletions"][nth]["id"].clone());
        assert_eq!(gone, ["person 1", "person 7"]);
        assert_eq!(deleted["entities"], json!([]));
    }

    #[test]
    fn a_skeleton_is_its_joints_with_a_place_their_spread_and_the_lines_between_them() {
        let mut foxglove = foxglove();
        let all = shown(&mut foxglove, &one(1));
        let entity = &all[3].1["entities"][0];
        // Two of the joints have no place or spread that is a number.
        let n = PARSE14.joints.len() - 2;
        assert_eq!(entity["spheres"].as_array().map(Vec::len), Some(2 * n));
        let has_both = |it: &&(usize, usize)| [it.0, it.1].iter().all(|it| ![2, 3].contains(it));
        let n_lines = PARSE14.limbs.iter().filter(has_both).count();
        let points = entity["lines"][0]["points"].as_array().map(Vec::len);
        assert_eq!(points, Some(2 * n_lines));
        let transform = &all[0].1["transforms"][0];
        let centre = camera(LensModel::Pinhole).centre_in_world();
        let x = transform["translation"]["x"].as_f64().unwrap();
        assert!((x - centre.x).abs() < 1e-12);
    }

    #[test]
    fn what_has_no_picture_and_what_ends_makes_no_message() {
        let mut foxglove = foxglove();
        let head = FrameHeader {
            width: 8,
            height: 6,
            ..FrameHeader::default()
        };
        assert_eq!(made(&mut foxglove, Kind::Frame, bytes_of(&head), &[]), []);
        let mut end = one(1);
        end.status = Status::END;
        assert_eq!(shown(&mut foxglove, &end), []);
        assert_eq!(foxglove.messages(Kind::Skeletons, &[1, 2, 3]), []);
        assert!(!foxglove.is_begun);
    }
}
