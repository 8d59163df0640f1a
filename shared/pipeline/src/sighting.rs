//! A person as one view sees them, by a network or by keypoints that another program found.

use keypoints::Keypoint;
use multiview::FrontEvidence;
use posenetwork::outline_of;
use skeleton::{JointSet, N_PARTS, PARSE14, SIDES};

use crate::placed::{N, between};
use crate::view_result::ExtraKeypoint;

/// Least heat of a joint that counts for the place of its person, 0 to 1.
const FAINT: f32 = 0.02;

/// A person as one view sees them. Left and right are those of the network or of the other program.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Where each joint of `skeleton::PARSE14` is seen best, pixels of the frame; `None` for one that is not.
    pub joints: [Option<[f32; 2]>; N],
    /// How sure that is, 0 to 1; 0 for one that is not seen.
    pub heats: [f32; N],
    /// Evidence of all joints, summed ([`posenetwork::JointMaps::score`]).
    pub score: f32,
    /// Evidence of the picture about the direction in which the person faces; zeros say nothing.
    pub front: FrontEvidence,
    /// The extra keypoints.
    pub extras: Vec<ExtraKeypoint>,
}

/// The people that one view sees in a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Sightings {
    /// The people, the largest and best seen first; not empty.
    pub people: Vec<Sighting>,
    /// How long after the instant of the frame the picture was taken, seconds; negative for before.
    pub skew_s: f64,
}

impl Sighting {
    /// A person by the peaks of maps.
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
        }
    }

    /// Returns true if half of the joints are seen well: sightings of networks in an empty room have fewer.
    ///
    /// * `least_heat`: of a joint that is seen well, 0 to 1.
    pub fn is_clear(&self, least_heat: f64) -> bool {
        let well = self.heats.iter().filter(|heat| f64::from(**heat) >= least_heat);
        well.count() >= N / 2
    }

    /// Where a joint is seen, pixels of the frame.
    pub fn joint(&self, joint: usize) -> Option<[f64; 2]> {
        self.joints[joint].map(|at| at.map(f64::from))
    }

    /// Where the joints are seen, pixels of the frame; NaN for one that is not.
    ///
    /// * `is_exchanged`: whether left and right are exchanged.
    pub fn places(&self, is_exchanged: bool) -> [[f64; 2]; N] {
        let mut places = core::array::from_fn(|joint| self.joint(joint).unwrap_or([f64::NAN; 2]));
        if is_exchanged {
            for [right, left] in SIDES {
                places.swap(right, left);
            }
        }
        places
    }

    /// The box around the joints that are seen ([`outline_of`]), pixels of the frame.
    pub fn outline(&self) -> Option<[f64; 4]> {
        let seen = (0..N).filter(|joint| self.heats[*joint] >= FAINT);
        outline_of(seen.filter_map(|joint| self.joint(joint)))
    }

    /// The joints of a set, as [`Self::places`].
    pub fn joints_of_set(&self, set: &JointSet, is_exchanged: bool) -> Vec<[f64; 2]> {
        set.from_parts(&parts_of(&self.places(is_exchanged)))
    }

    /// The cosine of the angle between the trunk in the picture and upward: -1 upside down; `None` where the trunk is not seen.
    pub(crate) fn trunk_upward(&self) -> Option<f64> {
        const NECK: usize = 12;
        const HIPS: [usize; 2] = [2, 3];
        let [right, left] = HIPS.map(|hip| self.joint(hip));
        let (neck, right, left) = (self.joint(NECK)?, right?, left?);
        let [x, y] = [0, 1].map(|axis| neck[axis] - f64::midpoint(right[axis], left[axis]));
        Some(-y / x.hypot(y))
    }
}

/// The parts of the paper's body, of which some lie between two joints.
///
/// * `joints`: of `skeleton::PARSE14`, in any plane.
pub fn parts_of(joints: &[[f64; 2]; PARSE14.joints.len()]) -> Vec<[f64; 2]> {
    let part = |part: usize| {
        let between = between(part);
        let [above, below] = between.joints.map(|joint| joints[joint]);
        [0, 1].map(|axis| above[axis] + (below[axis] - above[axis]) * between.share)
    };
    (0..N_PARTS).map(part).collect()
}
