//! A person for training, with picture and true keypoints.

use serde::{Deserialize, Serialize};

use super::{N_JOINTS, N_KEYPOINTS};

/// Side of the square picture that is stored for a person, in pixels.
pub const SIDE: usize = 256;
/// Height, in pixels of this picture, of the window that the network gets. The window is computed from the box around the marked joints.
pub const WINDOW: f64 = 176.0;

/// Origin of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// A photograph, marked by hand.
    Photograph,
    /// A synthetic scene.
    Scene,
}

/// Position of a keypoint that the network is trained to find.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Position in pixels; not finite if unknown.
    pub at: [f32; 2],
    /// A second, equally likely position, if the annotator's mark and the teacher contradict each other.
    pub or: Option<[f32; 2]>,
    /// Weight of the keypoint, 0 to 1.
    pub weight: f32,
    /// True if the keypoint was marked, is exact, or is an extra keypoint of which the teacher is certain.
    pub is_marked: bool,
}

/// A picture of a person, and the keypoints. Left and right are as seen in the picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Person {
    /// Origin of the picture.
    pub source: Source,
    /// Name of the picture in messages.
    pub name: String,
    /// Pixels of the picture, [`SIDE`] x [`SIDE`], red first.
    pub rgb: Vec<u8>,
    /// Targets of the joints, in the order of `skeleton::PARSE14`, then of [`EXTRAS`](super::EXTRAS).
    pub targets: [Target; N_KEYPOINTS],
    /// Direction in which the person faces: components towards the right of the picture, downwards, and towards the camera. Its length is
    /// the certainty, 0 to 1.
    pub front: [f32; 3],
}

impl Person {
    /// The positions of the joints that are known well enough to be used for the box around the person.
    pub fn places(&self) -> impl Iterator<Item = [f32; 2]> {
        let is_known =
            |target: &&Target| target.weight > 0.0 && target.at.iter().all(|side| side.is_finite());
        let joints = self.targets[..N_JOINTS].iter();
        joints.filter(is_known).map(|target| target.at)
    }

    /// Vector from the middle of the hips to the neck, in pixels; not finite if one of the joints is unknown.
    pub fn trunk(&self) -> [f32; 2] {
        let [right, left, neck] = [2, 3, 12].map(|joint: usize| self.targets[joint].at);
        [0, 1].map(|axis| neck[axis] - f32::midpoint(right[axis], left[axis]))
    }
}
