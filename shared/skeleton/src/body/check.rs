//! Check that a skeleton can be a person, and search for the joints that cannot belong to one.

use crate::body::bone::{self, BONES, SIDES, clean, joints_of};
use crate::body::lengths::{Learned, Lengths};
use crate::body::proportion::{Kind, MEASUREMENT_SD};
use crate::body::reach::{self, RANK};
use crate::body::stature::{MIN_BONES, STATURES, Stature, of_lengths};
use crate::body::verdict::{Reason, Verdict};
use crate::body::{Covariances, Joints, N_BONES, N_JOINTS};

/// A bone is impossible if its length is this many standard deviations from the expected one.
///
/// Our own choice. With a standard deviation of at least [`MEASUREMENT_SD`], 17.5 cm are always allowed: for a man of
/// 1.75 m a lower arm of 7 to 44 cm, an upper leg of 23 to 63 cm.
pub const LIMIT: f64 = 3.5;

/// How much longer one side is than the other, as a share of the length: standard deviation, our own choice.
const SIDES_DIFFER: f64 = 0.02;

/// How differently a person's stature is found from frame to frame, as a share: standard deviation, our own choice. Not
/// what the frame says of itself: the bones of a wrong skeleton disagree, and would excuse it.
const STATURE_SPREAD: f64 = 0.08;

/// Standard deviation of a reach, as a share of it: people and places, our own choice.
const REACH_SPREAD: f64 = 0.06;

/// A single bone counts at most this many standard deviations in [`Verdict::deviation`].
const MOST: f64 = 10.0;

/// Judges a skeleton.
///
/// A skeleton is not that of a person if it has fewer than [`MIN_BONES`] bones, a stature beyond [`STATURES`] or more than
/// 28 % from that of the learned lengths, or if more than half of its bones are impossible. Otherwise an impossible
/// bone loses its worst joint: the one that also spoils other bones, else the one farther from the trunk, else the one
/// with the larger covariance; and so on until what is left is possible. Impossible are
///
/// * a bone whose length is more than [`LIMIT`] standard deviations from what the stature lets expect, or the
///   learned length;
/// * the bones of the two sides, if one is more than [`LIMIT`] standard deviations longer than the other;
/// * two joints that hang together by missing joints only, if they are farther apart than the bones between them reach.
///
/// * `lengths`: the person's own, where they are known.
pub fn check(joints: &Joints, covariances: &Covariances, lengths: Option<&Lengths>) -> Verdict {
    let mut joints = clean(joints);
    let whole = Judgement::new(&joints, lengths);
    let nobody = |reason| Verdict {
        stature: whole.stature,
        deviation: whole.deviation(),
        dropped: [false; N_JOINTS],
        nobody: Some(reason),
    };
    if let Some(reason) = whole.reason() {
        return nobody(reason);
    }
    let bones = whole.n_bones();
    let impossible = whole.z.iter().flatten().filter(|z| z.abs() > LIMIT).count();
    if 2 * impossible > bones {
        return nobody(Reason::Impossible { impossible, bones });
    }
    let mut dropped = [false; N_JOINTS];
    let mut kept = Judgement::new(&joints, lengths);
    while let Some(joint) = kept.worst_joint(&joints, covariances) {
        dropped[joint] = true;
        joints[joint] = None;
        kept = Judgement::new(&joints, lengths);
    }
    if let Some(reason) = kept.reason() {
        return nobody(reason);
    }
    Verdict {
        stature: kept.stature,
        deviation: kept.deviation(),
        dropped,
        nobody: None,
    }
}

/// Expected length of a bone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    pub(crate) metres: f64,
    /// Standard deviation, metres.
    pub(crate) spread: f64,
}

/// The length of a kind of bone, learned or else of people with this stature.
pub(crate) fn expected(kind: Kind, stature: f64, lengths: Option<&Lengths>) -> Expected {
    let proportion = kind.proportion();
    if let Some(Learned { metres, sd }) = lengths.and_then(|length| length.of_kind(kind)) {
        let spread = sd.hypot(proportion.posture * metres);
        return Expected { metres, spread };
    }
    let metres = proportion.length(stature);
    Expected {
        metres,
        spread: proportion.spread() * metres,
    }
}

/// The bones of a skeleton against what is expected of them.
struct Judgement<'a> {
    stature: Option<Stature>,
    lengths: [Option<f64>; N_BONES],
    /// Deviation of every bone's length from the expected one, standard deviations.
    z: [Option<f64>; N_BONES],
    learned: Option<&'a Lengths>,
    /// The stature that lengths are expected of, metres: one that people have.
    expected_of: f64,
}

impl<'a> Judgement<'a> {
    fn new(joints: &Joints, learned: Option<&'a Lengths>) -> Self {
        let lengths = bone::lengths(joints);
        let stature = of_lengths(&lengths);
        let [low, high] = STATURES;
        let expected_of = stature.map_or(1.7, |stature| stature.metres.clamp(low, high));
        let z = core::array::from_fn(|i| {
            let it = expected(BONES[i].kind, expected_of, learned);
            let sd = it.spread.hypot(MEASUREMENT_SD);
            lengths[i].map(|length| (length - it.metres) / sd)
        });
        Self {
            stature,
            lengths,
            z,
            learned,
            expected_of,
        }
    }

    fn n_bones(&self) -> usize {
        self.z.iter().flatten().count()
    }

    fn deviation(&self) -> f64 {
        let n = self.n_bones().max(1);
        let capped = |z: &f64| z.clamp(-MOST, MOST).powi(2);
        (self.z.iter().flatten().map(capped).sum::<f64>() / n as f64).sqrt()
    }

    /// Why it is not a person, whatever its proportions.
    fn reason(&self) -> Option<Reason> {
        let Some(stature) = self.stature else {
            return Some(Reason::TooFewBones {
                bones: self.n_bones(),
                needed: MIN_BONES,
            });
        };
        let limits = self.statures();
        let [low, high] = limits;
        (!(low..=high).contains(&stature.metres)).then_some(Reason::Stature {
            metres: stature.metres,
            limits,
        })
    }

    /// The statures that are possible, metres: those of people, about that of the learned lengths of the bones that
    /// are there.
    fn statures(&self) -> [f64; 2] {
        let learned = |bone: usize| self.learned.and_then(|learned| learned.bone(bone));
        let lengths =
            core::array::from_fn(|i| self.lengths[i].and(learned(i)).map(|length| length.metres));
        let [low, high] = STATURES;
        of_lengths(&lengths).map_or(STATURES, |own| {
            let wide = LIMIT * STATURE_SPREAD * own.metres;
            [low.max(own.metres - wide), high.min(own.metres + wide)]
        })
    }

    /// The joint to drop; `None` if all that is there is possible.
    fn worst_joint(&self, joints: &Joints, covariances: &Covariances) -> Option<usize> {
        let mut worst: Option<Conflict> = None;
        let mut spoilt = [0_u32; N_JOINTS];
        self.conflicts(joints, |conflict| {
            for joint in joints_of(conflict.joints) {
                spoilt[joint] += 1;
            }
            if worst.is_none_or(|worst| conflict.z > worst.z) {
                worst = Some(conflict);
            }
        });
        let variance = |joint: usize| {
            let trace = covariances[joint].map_or(0.0, |covariance| covariance.trace());
            if trace.is_finite() { trace } else { f64::MAX }
        };
        let order = |a: &usize, b: &usize| {
            (spoilt[*a].cmp(&spoilt[*b]))
                .then(RANK[*a].cmp(&RANK[*b]))
                .then(variance(*a).total_cmp(&variance(*b)))
                .then(self.strain(*a).total_cmp(&self.strain(*b)))
        };
        joints_of(worst?.joints).max_by(order)
    }

    /// Sum of the deviations of a joint's bones.
    fn strain(&self, joint: usize) -> f64 {
        let of_joint = BONES.iter().zip(&self.z).filter(|bone| bone.0.mask() >> joint & 1 == 1);
        of_joint.filter_map(|bone| *bone.1).map(f64::abs).sum()
    }

    /// Calls `found` for everything that is impossible.
    fn conflicts(&self, joints: &Joints, mut found: impl FnMut(Conflict)) {
        for (bone, z) in BONES.iter().zip(&self.z) {
            if let Some(z) = z.map(f64::abs).filter(|z| *z > LIMIT) {
                found(Conflict {
                    joints: bone.mask(),
                    z,
                });
            }
        }
        for [right, left] in SIDES {
            let (Some(a), Some(b)) = (self.lengths[right], self.lengths[left]) else {
                continue;
            };
            let sd =
                (core::f64::consts::SQRT_2 * MEASUREMENT_SD).hypot(SIDES_DIFFER * 0.5 * (a + b));
            let z = (a - b).abs() / sd;
            if z > LIMIT {
                let of = |bone: usize| self.z[bone].map_or(0.0, f64::abs);
                let bone = if of(right) > of(left) { right } else { left };
                found(Conflict {
                    joints: BONES[bone].mask(),
                    z,
                });
            }
        }
        self.reaches(joints, found);
    }

    /// Calls `found` for joints that are too far apart for the missing bones between them.
    fn reaches(&self, joints: &Joints, mut found: impl FnMut(Conflict)) {
        let pieces = reach::pieces(joints);
        let length = |kind| expected(kind, self.expected_of, self.learned).metres;
        for (a, piece) in pieces.iter().enumerate() {
            for b in a + 1..N_JOINTS {
                let (Some(from), Some(to)) = (joints[a], joints[b]) else {
                    continue;
                };
                if piece >> b & 1 == 1 {
                    continue;
                }
                let reach = reach::between(a, b, length);
                let z = ((to - from).norm() - reach) / MEASUREMENT_SD.hypot(REACH_SPREAD * reach);
                if z > LIMIT {
                    found(Conflict {
                        joints: 1 << a | 1 << b,
                        z,
                    });
                }
            }
        }
    }
}

/// Something impossible.
#[derive(Clone, Copy)]
struct Conflict {
    /// Bit `i` is set if joint `i` takes part.
    joints: u32,
    /// How impossible, standard deviations.
    z: f64,
}

#[cfg(test)]
mod tests;
