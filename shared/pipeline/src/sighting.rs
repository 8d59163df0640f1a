//! A person as seen by one view, from a network or from keypoints found by another program.

use keypoints::Keypoint;
use multiview::FrontEvidence;
use posenetwork::outline_of;
use skeleton::{JointSet, N_PARTS, PARSE14, SIDES};

use crate::placed::{N, between};
use crate::view_result::ExtraKeypoint;

/// Minimum heat (0 to 1) at which a joint is used to compute the person's position.
const FAINT: f32 = 0.02;

/// A person as seen by one view. Left and right are named as by the network or the other program.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Best position of each joint of `skeleton::PARSE14`, in pixels of the frame; `None` for a joint that is not seen.
    pub joints: [Option<[f32; 2]>; N],
    /// Confidence in each joint, 0 to 1; 0 for a joint that is not seen.
    pub heats: [f32; N],
    /// Sum of the evidence of all joints ([`posenetwork::JointMaps::score`]).
    pub score: f32,
    /// Evidence of the picture about the direction in which the person faces; zeros mean no evidence.
    pub front: FrontEvidence,
    /// Extra keypoints of the person.
    pub extras: Vec<ExtraKeypoint>,
    /// Median red, green and blue of the trunk, 0 to 1; `None` if the trunk is not seen, or if there is no picture.
    pub colour: Option<[f32; 3]>,
    /// Time since the network last ran on the person, in seconds. It is above 0 if the person was left out to save time.
    pub age_s: f32,
}

/// The people that one view sees in a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSightings {
    /// The people, the largest and clearest first; never empty.
    pub people: Vec<Sighting>,
    /// Time of the picture after the instant of the frame, in seconds; negative if it was taken before.
    pub skew_s: f64,
}

impl Sighting {
    /// Creates a person from the peaks of the network's maps.
    pub(crate) fn new(peaks: &[Option<Keypoint>], score: f32) -> Self {
        let peak = |joint: usize| peaks.get(joint).copied().flatten();
        let heat = |joint: usize| peak(joint).map_or(0.0, |peak| peak.score.clamp(0.0, 1.0) as f32);
        let place = |joint: usize| {
            let seen = peak(joint).filter(|_| heat(joint) > 0.0);
            seen.map(|peak| peak.at.map(|side| side as f32))
        };
        Self {
            joints: core::array::from_fn(place),
            heats: core::array::from_fn(heat),
            score,
            front: FrontEvidence::default(),
            extras: Vec::new(),
            colour: None,
            age_s: 0.0,
        }
    }

    /// Returns true if half of the joints are clearly visible. False detections in an empty room have fewer clear joints.
    ///
    /// * `least_heat`: minimum heat of a clearly visible joint, 0 to 1.
    pub fn is_clear(&self, least_heat: f64) -> bool {
        let well = self.heats.iter().filter(|heat| f64::from(**heat) >= least_heat);
        well.count() >= N / 2
    }

    /// Returns the position of a joint, in pixels of the frame; `None` if it is not seen.
    pub fn joint(&self, joint: usize) -> Option<[f64; 2]> {
        self.joints[joint].map(|at| at.map(f64::from))
    }

    /// Returns the positions of the joints, in pixels of the frame; NaN for a joint that is not seen.
    ///
    /// * `is_exchanged`: true to swap left and right.
    pub fn places(&self, is_exchanged: bool) -> [[f64; 2]; N] {
        let mut places = core::array::from_fn(|joint| self.joint(joint).unwrap_or([f64::NAN; 2]));
        if is_exchanged {
            for [right, left] in SIDES {
                places.swap(right, left);
            }
        }
        places
    }

    /// Returns the box around the seen joints ([`outline_of`]), in pixels of the frame.
    pub fn outline(&self) -> Option<[f64; 4]> {
        let seen = (0..N).filter(|joint| self.heats[*joint] >= FAINT);
        outline_of(seen.filter_map(|joint| self.joint(joint)))
    }

    /// Returns the positions of the joints of a set, like [`Self::places`].
    pub fn joints_of_set(&self, set: &JointSet, is_exchanged: bool) -> Vec<[f64; 2]> {
        set.from_parts(&parts_of(&self.places(is_exchanged)))
    }

    /// Returns the cosine of the angle between the trunk in the picture and the upward direction: -1 upside down; `None` if the trunk is
    /// not seen.
    pub(crate) fn trunk_upward(&self) -> Option<f64> {
        const NECK: usize = 12;
        const HIPS: [usize; 2] = [2, 3];
        let [right, left] = HIPS.map(|hip| self.joint(hip));
        let (neck, right, left) = (self.joint(NECK)?, right?, left?);
        let [x, y] = [0, 1].map(|axis| neck[axis] - f64::midpoint(right[axis], left[axis]));
        Some(-y / x.hypot(y))
    }
}

/// Returns the parts of the paper's body model; some of them lie between two joints.
///
/// * `joints`: positions of the joints of `skeleton::PARSE14`, in any plane.
pub fn parts_of(joints: &[[f64; 2]; PARSE14.joints.len()]) -> Vec<[f64; 2]> {
    let part = |part: usize| {
        let between = between(part);
        let [above, below] = between.joints.map(|joint| joints[joint]);
        [0, 1].map(|axis| above[axis] + (below[axis] - above[axis]) * between.share)
    };
    (0..N_PARTS).map(part).collect()
}
