//! Judgement of a skeleton, and the reason why it is not a person.

use core::fmt;

use crate::body::bone::clean;
use crate::body::stature::Stature;
use crate::body::{Joints, N_JOINTS};

/// Why a skeleton is not that of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// There is too little of it.
    TooFewBones {
        /// Bones whose joints are there and possible.
        bones: usize,
        /// Bones needed.
        needed: usize,
    },
    /// Nobody is that tall, or that small; or the person with the learned lengths is not.
    Stature {
        /// The stature that its bones agree on, metres.
        metres: f64,
        /// The statures that are possible, metres.
        limits: [f64; 2],
    },
    /// More than half of its bones have lengths that no person of its stature has.
    Impossible {
        /// Impossible bones.
        impossible: usize,
        /// All bones whose joints are there.
        bones: usize,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewBones { bones, needed } => {
                write!(f, "only {bones} bones are possible, {needed} are needed")
            }
            Self::Stature { metres, limits } => {
                let [low, high] = limits;
                write!(
                    f,
                    "it would be {metres:.2} m tall; {low:.2} to {high:.2} m are possible"
                )
            }
            Self::Impossible { impossible, bones } => {
                write!(f, "{impossible} of {bones} bones have impossible lengths")
            }
        }
    }
}

/// Judgement of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The standing height, from the joints that are kept; from all if it is not a person. `None` with too few bones.
    pub stature: Option<Stature>,
    /// Root mean square of the deviations of the bones' lengths from the expected ones, in standard deviations: 0 to 1
    /// is ordinary. Of the joints that are kept; of all if it is not a person; 0 without bones.
    pub deviation: f64,
    /// The joints that must not be reported: those of impossible bones. A missing joint is not dropped.
    pub dropped: [bool; N_JOINTS],
    /// Why it is not a person; then no joint is to be reported.
    pub nobody: Option<Reason>,
}

impl Verdict {
    /// The joints that may be reported.
    #[must_use]
    pub fn keep(&self, joints: &Joints) -> Joints {
        let joints = clean(joints);
        core::array::from_fn(|i| joints[i].filter(|_| !self.dropped[i] && self.nobody.is_none()))
    }
}
