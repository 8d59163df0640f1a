//! Chooses one position for every joint, by the support from the views and by the lengths of the bones.

use nalgebra::Point3;
use skeleton::body::BONES;

use crate::N;

/// Each joint with its parent towards the neck and the bone between them; parents come before their children, starting from the neck.
const BRANCHES: [(usize, usize, Limb); N - 1] = [
    (13, 12, Limb::Bone(13)),
    (8, 12, Limb::Bone(9)),
    (9, 12, Limb::Bone(10)),
    (7, 8, Limb::Bone(6)),
    (10, 9, Limb::Bone(7)),
    (6, 7, Limb::Bone(5)),
    (11, 10, Limb::Bone(8)),
    (2, 12, Limb::TrunkToHip),
    (3, 12, Limb::TrunkToHip),
    (1, 2, Limb::Bone(1)),
    (4, 3, Limb::Bone(3)),
    (0, 1, Limb::Bone(0)),
    (5, 4, Limb::Bone(4)),
];
const ROOT: usize = 12;
/// Index of the trunk in `BONES`; the next constant is the index of the width of the hips.
const TRUNK: usize = 12;
const HIP_WIDTH: usize = 2;

/// Standard deviation of a bone's length, in metres, that comes from the candidate positions of its joints; it is added to the deviation of
/// the length itself.
const PLACE_SD_M: f64 = 0.04;
/// Cost of a bone for each half squared standard deviation; the next constant is the maximum of this cost.
const BONE: f64 = 0.25;
const MOST_OF_BONE: f64 = 1.0;

#[derive(Debug, Clone, Copy)]
enum Limb {
    /// A bone, by its index in `BONES`.
    Bone(usize),
    TrunkToHip,
}

/// An expected length, in metres.
#[derive(Debug, Clone, Copy)]
struct Expected {
    metres: f64,
    sd: f64,
}

/// The expected bone lengths of a person of a given stature.
#[derive(Debug, Clone)]
pub(crate) struct Expectations {
    limbs: [Expected; N - 1],
}

impl Expectations {
    pub(crate) fn new(stature: f64) -> Self {
        let of_bone = |index: usize| {
            let proportion = BONES[index].kind.proportion();
            let metres = proportion.length(stature);
            Expected {
                metres,
                sd: proportion.spread() * metres,
            }
        };
        Self {
            limbs: BRANCHES.map(|(_, _, limb)| match limb {
                Limb::Bone(index) => of_bone(index),
                Limb::TrunkToHip => {
                    let [trunk, hips] = [of_bone(TRUNK), of_bone(HIP_WIDTH)];
                    Expected {
                        metres: trunk.metres.hypot(0.5 * hips.metres),
                        sd: trunk.sd,
                    }
                }
            }),
        }
    }

    fn cost(&self, branch: usize, length: f64) -> f64 {
        let expected = self.limbs[branch];
        let z = (length - expected.metres) / expected.sd.hypot(PLACE_SD_M);
        (BONE * 0.5 * z * z).min(MOST_OF_BONE)
    }
}

/// A candidate position of a joint, and its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Choice {
    pub(crate) place: Point3<f64>,
    pub(crate) worth: f64,
}

/// Chooses one position for every joint so that the total score, minus the costs of the bones between the positions, is maximal.
///
/// * Returns the index of each joint's choice; `None` if the best position of the joint costs more than its score.
pub(crate) fn choose(
    choices: &[Vec<Choice>; N],
    expectations: &Expectations,
) -> [Option<usize>; N] {
    // Score of every choice including its subtree, and of leaving the joint out; the children of a joint are computed first.
    let mut worths: [Vec<f64>; N] = core::array::from_fn(|joint| {
        let each = choices[joint].iter().map(|choice| choice.worth);
        each.chain([0.0]).collect()
    });
    let mut best_of: [Vec<usize>; N - 1] = core::array::from_fn(|_| Vec::new());
    for (branch, (joint, parent, _)) in BRANCHES.iter().enumerate().rev() {
        let above = choices[*parent].iter().map(|choice| Some(choice.place)).chain([None]);
        for (nth, above) in above.enumerate() {
            let below = choices[*joint].iter().map(|choice| Some(choice.place)).chain([None]);
            let with = below.zip(&worths[*joint]).map(|(place, worth)| {
                let both = above.zip(place);
                worth - both.map_or(0.0, |(a, b)| expectations.cost(branch, (a - b).norm()))
            });
            let (best, worth) = most(with);
            best_of[branch].push(best);
            worths[*parent][nth] += worth;
        }
    }
    let mut chosen = [0; N];
    chosen[ROOT] = most(worths[ROOT].iter().copied()).0;
    for (branch, (joint, parent, _)) in BRANCHES.iter().enumerate() {
        chosen[*joint] = best_of[branch][chosen[*parent]];
    }
    core::array::from_fn(|joint| Some(chosen[joint]).filter(|nth| *nth < choices[joint].len()))
}

fn most(worths: impl Iterator<Item = f64>) -> (usize, f64) {
    worths.enumerate().fold((0, f64::NEG_INFINITY), |best, (nth, worth)| {
        if worth > best.1 { (nth, worth) } else { best }
    })
}
