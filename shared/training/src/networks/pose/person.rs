//! A person to learn from.

use serde::{Deserialize, Serialize};

use super::{N_JOINTS, N_KEYPOINTS};

/// Side of the square picture that is kept of a person, pixels.
pub const SIDE: usize = 256;
/// Height of the network's window in it, as the box around the marked joints asks for, pixels.
pub const WINDOW: f64 = 176.0;

/// Where a picture comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// A photograph, marked by hand.
    Photograph,
    /// A scene that does not exist.
    Scene,
}

/// Target of the network for a keypoint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Where it is, pixels; not finite if nobody knows.
    pub at: [f32; 2],
    /// Another place that is as likely, where the mark and the teacher contradict each other.
    pub or: Option<[f32; 2]>,
    /// How much it counts, 0 to 1.
    pub weight: f32,
    /// True if it was marked, is exact, or is an extra keypoint that the teacher is sure of.
    pub is_marked: bool,
}

/// A picture of a person, and where the keypoints are: as seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Person {
    /// Where it comes from.
    pub source: Source,
    /// Name in messages.
    pub name: String,
    /// The picture: [`SIDE`] pixels square, red first.
    pub rgb: Vec<u8>,
    /// The joints, in the order of `skeleton::PARSE14`, then [`EXTRAS`](super::EXTRAS).
    pub targets: [Target; N_KEYPOINTS],
    /// In which direction the person faces: towards the right of the picture, downwards, towards the camera; its length is the
    /// certainty, 0 to 1.
    pub front: [f32; 3],
}

impl Person {
    /// The places of the joints that are known well enough to lay a box around them.
    pub fn places(&self) -> impl Iterator<Item = [f32; 2]> {
        let is_known =
            |target: &&Target| target.weight > 0.0 && target.at.iter().all(|side| side.is_finite());
        let joints = self.targets[..N_JOINTS].iter();
        joints.filter(is_known).map(|target| target.at)
    }

    /// From the middle of the hips to the neck, pixels; not finite if one of them is not known.
    pub fn trunk(&self) -> [f32; 2] {
        let [right, left, neck] = [2, 3, 12].map(|joint: usize| self.targets[joint].at);
        [0, 1].map(|axis| neck[axis] - f32::midpoint(right[axis], left[axis]))
    }
}
