//! The skin: pieces with flat faces, each moved by one node.

use footage::Colour;
use nalgebra::Point3;
use serde_json::{Value, json};

use super::store::Store;

/// A triangle, counter-clockwise when seen from outside.
type Face = [[f64; 3]; 3];

const FROM: [f64; 3] = [0.0, 0.0, 0.0];
const TO: [f64; 3] = [0.0, 1.0, 0.0];
const EAST: [f64; 3] = [0.5, 0.2, 0.0];
const SOUTH: [f64; 3] = [0.0, 0.2, 0.5];
const WEST: [f64; 3] = [-0.5, 0.2, 0.0];
const NORTH: [f64; 3] = [0.0, 0.2, -0.5];

/// A bone from the origin to y = 1, widest near its beginning, as animation programs draw bones.
pub(super) const BONE: [Face; 8] = [
    [TO, SOUTH, EAST],
    [TO, WEST, SOUTH],
    [TO, NORTH, WEST],
    [TO, EAST, NORTH],
    [FROM, EAST, SOUTH],
    [FROM, SOUTH, WEST],
    [FROM, WEST, NORTH],
    [FROM, NORTH, EAST],
];

/// Returns an octahedron around the origin.
pub(super) fn mark(radius: f64) -> Vec<Face> {
    let place = |[x, y, z]: [f64; 3]| match () {
        () if y == 0.0 => [0.0, -radius, 0.0],
        () if y == 1.0 => [0.0, radius, 0.0],
        () => [2.0 * x * radius, 0.0, 2.0 * z * radius],
    };
    BONE.iter().map(|face| face.map(place)).collect()
}

/// Vertices, three for each face, and their attributes.
#[derive(Default)]
pub(super) struct Mesh {
    places: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[f32; 3]>,
    joints: Vec<[u16; 4]>,
}

impl Mesh {
    /// Adds a piece.
    ///
    /// * `joint`: the joint of the skin that moves the piece.
    pub(super) fn add(
        &mut self,
        shape: &[Face],
        to_scene: impl Fn([f64; 3]) -> Point3<f64>,
        joint: usize,
        colour: Colour,
    ) {
        for face in shape {
            let [a, b, c] = face.map(&to_scene);
            let normal = (b - a).cross(&(c - a));
            let length = normal.norm();
            let normal = if length > 0.0 {
                normal / length
            } else {
                nalgebra::Vector3::y()
            };
            for place in [a, b, c] {
                self.places.push([place.x as f32, place.y as f32, place.z as f32]);
                self.normals.push([normal.x as f32, normal.y as f32, normal.z as f32]);
                self.colours.push(colour.map(linear));
                self.joints.push([joint as u16, 0, 0, 0]);
            }
        }
    }

    /// Adds the mesh to the store.
    pub(super) fn store(&self, store: &mut Store) -> Value {
        let n = u16::try_from(self.places.len()).unwrap_or(u16::MAX);
        let weights = vec![[1.0, 0.0, 0.0, 0.0]; self.places.len()];
        json!({
            "name": "body",
            "primitives": [{
                "attributes": {
                    "POSITION": store.vertices(&self.places, "VEC3"),
                    "NORMAL": store.vertices(&self.normals, "VEC3"),
                    "COLOR_0": store.vertices(&self.colours, "VEC3"),
                    "JOINTS_0": store.joints(&self.joints),
                    "WEIGHTS_0": store.vertices::<4>(&weights, "VEC4"),
                },
                "indices": store.indices(&(0..n).collect::<Vec<u16>>()),
                "material": 0,
            }],
        })
    }
}

/// Converts a channel of sRGB to a vertex colour of glTF: linear, 0 to 1.
fn linear(channel: u8) -> f32 {
    let value = f32::from(channel) / 255.0;
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
