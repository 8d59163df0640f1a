//! Checks the Foxglove messages against their schemas, for frames with nobody, one person and two people.

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

/// Returns a frame with one person.
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

/// Returns the Foxglove messages of a frame.
fn shown(foxglove: &mut Foxglove, frame: &Skeletons) -> Vec<(usize, Value)> {
    let [head, people] = recording::split_skeletons(frame);
    made(foxglove, Kind::Skeletons, head, people)
}

/// Returns the Foxglove messages for one of Parallax's messages.
fn made(foxglove: &mut Foxglove, kind: Kind, head: &[u8], elements: &[u8]) -> Vec<(usize, Value)> {
    let mut data = Vec::new();
    encode(kind, head, elements, &mut data);
    let made = foxglove.messages(kind, &data).into_iter();
    made.map(|(topic, text)| (topic, serde_json::from_str(&text).unwrap()))
        .collect()
}

/// Returns the reason why a value does not match a schema, if it does not. Checks types and required fields.
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
fn messages_match_the_schemas_of_foxglove_and_cameras_come_first() {
    let mut foxglove = foxglove();
    let topics = foxglove.topics();
    let mut two = one(1);
    (two.n_people, two.people[1]) = (2, one(7).people[0]);
    let mut all = shown(&mut foxglove, &two);
    let order: Vec<usize> = all.iter().map(|message| message.0).collect();
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
fn a_skeleton_becomes_spheres_for_joints_and_spreads_and_lines_for_limbs() {
    let mut foxglove = foxglove();
    let all = shown(&mut foxglove, &one(1));
    let entity = &all[3].1["entities"][0];
    // Two joints have a position or covariance that is not a number.
    let n = PARSE14.joints.len() - 2;
    assert_eq!(entity["spheres"].as_array().map(Vec::len), Some(2 * n));
    let has_both =
        |limb: &&(usize, usize)| [limb.0, limb.1].iter().all(|joint| ![2, 3].contains(joint));
    let n_lines = PARSE14.limbs.iter().filter(has_both).count();
    let points = entity["lines"][0]["points"].as_array().map(Vec::len);
    assert_eq!(points, Some(2 * n_lines));
    let transform = &all[0].1["transforms"][0];
    let centre = camera(LensModel::Pinhole).centre_in_world();
    let x = transform["translation"]["x"].as_f64().unwrap();
    assert!((x - centre.x).abs() < 1e-12);
}

#[test]
fn missing_pictures_and_ends_of_streams_give_no_message() {
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
