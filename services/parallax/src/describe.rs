//! Describes poses as JSON. Pixels are counted from 0; part types and pyramid levels are counted from 1.

use std::sync::Arc;

use fmp::{Layout, Model, Pose};
use serde_json::{Map, Value, json};
use skeleton::{JointMap, JointSet};

/// The joints to report.
#[derive(Debug, Clone)]
pub(crate) struct NamedJoints {
    /// The joint set, which has the names.
    pub(crate) set: &'static JointSet,
    /// Mapping from parts to joints. Without a mapping, each joint is one of the parts.
    pub(crate) map: Option<Arc<JointMap>>,
}

/// A pose with the layout of its pyramid, and the scale from pixels of the searched image to reported pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed<'a> {
    pose: &'a Pose,
    model: &'a Model,
    layout: &'a Layout,
    /// Reported pixels per pixel of the searched image, horizontally and vertically.
    scaled: [f64; 2],
}

impl<'a> Placed<'a> {
    /// Creates the description of a pose, in pixels of the searched image.
    pub(crate) fn new(pose: &'a Pose, model: &'a Model, layout: &'a Layout) -> Self {
        Self {
            pose,
            model,
            layout,
            scaled: [1.0; 2],
        }
    }

    /// Reports positions in pixels of the original picture, of which the searched image is a scaled copy.
    ///
    /// * `per_pixel`: pixels of the picture per pixel of the searched image, horizontally and vertically.
    pub(crate) fn scaled(self, per_pixel: [f64; 2]) -> Self {
        Self {
            scaled: per_pixel,
            ..self
        }
    }

    /// Returns score, level, scale and parts as JSON. With `joints`, also returns the joints of the set: null for joints that need parts
    /// that the model lacks.
    pub(crate) fn json(&self, joints: Option<&NamedJoints>) -> Value {
        let centres: Vec<[f64; 2]> = self
            .pose
            .centres(self.model, self.layout)
            .into_iter()
            .map(|centre| self.at(centre))
            .collect();
        let parts: Vec<Value> = centres
            .iter()
            .enumerate()
            .map(|(part, centre)| self.part(part, *centre))
            .collect();
        let scale = self.layout.levels[usize::from(self.pose.level)].scale;
        let mut value = json!({
            "score": self.pose.score,
            "level": self.pose.level + 1,
            "scale": scale * self.scaled[0],
            "parts": parts,
        });
        if let (Some(joints), Some(object)) = (joints, value.as_object_mut()) {
            object.insert("joints".to_owned(), joints_of(&centres, joints));
        }
        value
    }

    fn part(&self, part: usize, [x, y]: [f64; 2]) -> Value {
        let mixture = self.pose.parts[part].mixture + 1;
        let [x1, y1, x2, y2] = self.pose.part_box(self.model, self.layout, part);
        let ([x1, y1], [x2, y2]) = (self.at([x1, y1]), self.at([x2, y2]));
        let corners = [x1, y1, x2, y2];
        json!({ "x": x, "y": y, "type": mixture, "box": corners })
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [right, down] = self.scaled;
        if self.scaled == [1.0; 2] {
            [x, y]
        } else {
            [(x + 0.5) * right - 0.5, (y + 0.5) * down - 0.5]
        }
    }
}

/// Returns the joints of a pose by name: null for joints that need parts that the model lacks.
fn joints_of(centres: &[[f64; 2]], joints: &NamedJoints) -> Value {
    let set = joints.set;
    let needed = set.joints.iter().flat_map(|joint| joint.parts).max().map_or(0, |part| part + 1);
    if centres.len() < needed {
        return Value::Null;
    }
    let found = match &joints.map {
        Some(map) => map.from_parts(centres),
        None => set.from_parts(centres),
    };
    let named = set.joints.iter().zip(found);
    Value::Object(
        named
            .map(|(joint, place)| (joint.name.to_owned(), json!(place)))
            .collect::<Map<_, _>>(),
    )
}

/// Parses the name of a joint set.
pub(crate) fn joint_set(name: &str) -> Result<&'static JointSet, String> {
    let known = || JointSet::ALL.map(|joint_set| joint_set.name).join(", ");
    JointSet::by_name(name).ok_or_else(|| format!("expected one of {}", known()))
}
