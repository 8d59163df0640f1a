//! The skeleton in space, frame by frame: what the script of the page draws.

use serde_json::{Value, json};

/// A place in space, metres in the world.
pub type Point = [f64; 3];

/// Everything that is drawn in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Names of the joints; those of either side begin with it (`left`, `right`).
    pub joints: Vec<String>,
    /// Joints that a line connects.
    pub limbs: Vec<(usize, usize)>,
    /// The cameras, in the order of [`Moment::views`].
    pub eyes: Vec<Eye>,
    /// Against gravity.
    pub up: Point,
    /// The results, in the order of time.
    pub moments: Vec<Moment>,
}

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    /// Its name.
    pub name: String,
    /// Its centre, metres in the world.
    pub at: Point,
    /// Where it looks, of length 1.
    pub axis: Point,
}

/// One result.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Number of the frame.
    pub frame: u64,
    /// When it was taken, seconds since the first frame.
    pub seconds: f64,
    /// The joints that were found.
    pub found: Vec<Option<Point>>,
    /// Where they are; empty if that is not known.
    pub truth: Vec<Point>,
    /// For every view nothing, or why it has no part in this result.
    pub views: Vec<Option<String>>,
}

impl Space {
    /// For the script: coordinates in whole millimetres.
    pub(crate) fn json(&self) -> Value {
        let mm = |point: &Point| point.map(|value| (1000.0 * value).round() as i64);
        let eyes = self
            .eyes
            .iter()
            .map(|eye| json!({ "name": eye.name, "at": mm(&eye.at), "axis": eye.axis }));
        let moments = self.moments.iter().map(|moment| {
            json!({
                "frame": moment.frame,
                "seconds": (100.0 * moment.seconds).round() / 100.0,
                "found": moment.found.iter().map(|joint| joint.as_ref().map(mm)).collect::<Vec<_>>(),
                "truth": moment.truth.iter().map(mm).collect::<Vec<_>>(),
                "views": moment.views,
            })
        });
        json!({
            "joints": self.joints,
            "limbs": self.limbs,
            "up": self.up,
            "eyes": eyes.collect::<Vec<_>>(),
            "moments": moments.collect::<Vec<_>>(),
        })
    }
}
