//! The verdict on a skeleton, and the reason if it cannot be a person's.

use core::fmt;

use crate::body::bone::clean;
use crate::body::stature::Stature;
use crate::body::{Joints, N_JOINTS};

/// Reason why a skeleton cannot be a person's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// Too few bones are known.
    TooFewBones {
        /// Number of bones whose joints are present and possible.
        bones: usize,
        /// Minimum number of such bones.
        needed: usize,
    },
    /// The stature is impossible for any person, or for the person whose lengths were learned.
    Stature {
        /// The stature on which the bones agree, in metres.
        metres: f64,
        /// Minimum and maximum possible stature, in metres.
        limits: [f64; 2],
    },
    /// More than half of the bones have lengths that are impossible for a person of this stature.
    Impossible {
        /// Number of impossible bones.
        impossible: usize,
        /// Number of bones whose joints are present.
        bones: usize,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewBones { bones, needed } => {
                write!(
                    f,
                    "only {bones} bones are possible, but {needed} are needed"
                )
            }
            Self::Stature { metres, limits } => {
                let [low, high] = limits;
                write!(
                    f,
                    "the person would be {metres:.2} m tall; {low:.2} to {high:.2} m are possible"
                )
            }
            Self::Impossible { impossible, bones } => {
                write!(f, "{impossible} of {bones} bones have impossible lengths")
            }
        }
    }
}

/// The verdict on a skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The standing height, computed from the kept joints, or from all joints if the skeleton cannot be a person's. `None` if there are too
    /// few bones.
    pub stature: Option<Stature>,
    /// Root mean square deviation of the bone lengths from the expected lengths, in standard deviations; values from 0 to 1 are usual. It
    /// is computed from the kept joints, or from all joints if the skeleton cannot be a person's; 0 without bones.
    pub deviation: f64,
    /// For every joint, true if it makes a bone impossible and must not be reported. A missing joint is not dropped.
    pub dropped: [bool; N_JOINTS],
    /// Reason why the skeleton cannot be a person's; if set, no joint must be reported.
    pub nobody: Option<Reason>,
}

impl Verdict {
    /// Returns the joints that may be reported.
    #[must_use]
    pub fn keep(&self, joints: &Joints) -> Joints {
        let joints = clean(joints);
        core::array::from_fn(|i| joints[i].filter(|_| !self.dropped[i] && self.nobody.is_none()))
    }
}
