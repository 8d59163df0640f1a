//! The binary part of the file, and the positions of the data in it.

use serde_json::{Value, json};

/// Component types of glTF.
const REAL: u32 = 5126;
const WORD: u32 = 5123;
/// Targets of a view.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The binary part, its views and accessors.
#[derive(Default)]
pub(super) struct Store {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
}

impl Store {
    /// Adds reals, and returns the index of their accessor.
    ///
    /// * `each`: number of values per element.
    pub(super) fn reals(&mut self, values: &[f32], each: usize, kind: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(&bytes, None, REAL, (values.len() / each, kind))
    }

    /// Adds times, with their range.
    pub(super) fn times(&mut self, values: &[f32]) -> usize {
        let index = self.reals(values, 1, "SCALAR");
        let of = |choose: fn(f32, f32) -> f32| values.iter().copied().reduce(choose).unwrap_or(0.0);
        self.accessors[index]["min"] = json!([of(f32::min)]);
        self.accessors[index]["max"] = json!([of(f32::max)]);
        index
    }

    /// Adds an attribute of vertices, with its range.
    pub(super) fn vertices<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> usize {
        let flat = values.as_flattened();
        let bytes: Vec<u8> = flat.iter().flat_map(|value| value.to_le_bytes()).collect();
        let index = self.add(&bytes, Some(VERTICES), REAL, (values.len(), kind));
        let of = |choose: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N)
                .map(|i| values.iter().map(|all| all[i]).reduce(choose).unwrap_or(0.0))
                .collect()
        };
        self.accessors[index]["min"] = json!(of(f32::min));
        self.accessors[index]["max"] = json!(of(f32::max));
        index
    }

    /// Adds numbers of joints, four for each vertex.
    pub(super) fn joints(&mut self, values: &[[u16; 4]]) -> usize {
        let flat = values.as_flattened();
        let bytes: Vec<u8> = flat.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(&bytes, Some(VERTICES), WORD, (values.len(), "VEC4"))
    }

    /// Adds numbers of vertices.
    pub(super) fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(&bytes, Some(INDICES), WORD, (values.len(), "SCALAR"))
    }

    fn add(
        &mut self,
        bytes: &[u8],
        target: Option<u32>,
        component: u32,
        (count, kind): (usize, &str),
    ) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0,
            "byteOffset": self.bytes.len(),
            "byteLength": bytes.len(),
        });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1,
            "componentType": component,
            "count": count,
            "type": kind,
        }));
        self.accessors.len() - 1
    }
}
