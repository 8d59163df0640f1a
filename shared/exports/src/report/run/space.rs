//! The skeleton in space, frame by frame: data for the script of the page.

use serde_json::{Value, json};

/// A point in space, in metres in the world.
pub type Point = [f64; 3];

/// Everything that is drawn in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Names of the joints. Names of joints with a side begin with it (`left`, `right`).
    pub joints: Vec<String>,
    /// Pairs of joints that a line connects.
    pub limbs: Vec<(usize, usize)>,
    /// The cameras, in the order of [`Moment::views`].
    pub eyes: Vec<Eye>,
    /// Upward direction.
    pub up: Point,
    /// The results, in the order of time.
    pub moments: Vec<Moment>,
}

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    /// Name of the camera.
    pub name: String,
    /// Centre of the camera, in metres in the world.
    pub at: Point,
    /// Viewing direction of the camera, of length 1.
    pub axis: Point,
}

/// One result.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Number of the frame.
    pub frame: u64,
    /// Time at which the frame was taken, in seconds since the first frame.
    pub seconds: f64,
    /// Positions of the joints that were found.
    pub found: Vec<Option<Point>>,
    /// True positions of the joints; empty if they are not known.
    pub truth: Vec<Point>,
    /// For every view, `None`, or the reason why it did not contribute to this result.
    pub views: Vec<Option<String>>,
}

impl Space {
    /// Returns the data for the script, with coordinates in whole millimetres.
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
