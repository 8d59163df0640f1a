//! Checks whether a skeleton can be a person, and finds the joints that cannot belong to it.

use crate::body::bone::{self, BONES, SIDES, clean, joints_of};
use crate::body::lengths::{Learned, Lengths};
use crate::body::proportion::{Kind, MEASUREMENT_SD};
use crate::body::reach::{self, RANK};
use crate::body::stature::{MIN_BONES, STATURES, Stature, of_lengths};
use crate::body::verdict::{Reason, Verdict};
use crate::body::{Covariances, Joints, N_BONES, N_JOINTS};

/// Number of standard deviations by which the length of a bone may differ from the expected length; beyond this, the bone is impossible.
///
/// The value is our own choice. The standard deviation is at least [`MEASUREMENT_SD`], so a difference of 17.5 cm is always allowed. For a
/// man of 1.75 m, a lower arm may be 7 to 44 cm long, and an upper leg 23 to 63 cm.
pub const LIMIT: f64 = 3.5;

/// Standard deviation of the difference between left and right, as a fraction of the length; our own choice.
const SIDES_DIFFER: f64 = 0.02;

/// Standard deviation of a person's estimated stature from frame to frame, as a fraction of the stature; our own choice. The uncertainty
/// computed from a single frame is not used instead: it is large for a wrong skeleton, whose bones disagree, so that a wrong skeleton would
/// be accepted.
const STATURE_SPREAD: f64 = 0.08;

/// Standard deviation of a reach, as a fraction of the reach, due to differences between people and between joint placements; our own
/// choice.
const REACH_SPREAD: f64 = 0.06;

/// Maximum contribution of a single bone to [`Verdict::deviation`], in standard deviations.
const MOST: f64 = 10.0;

/// Judges a skeleton.
///
/// A skeleton cannot be a person's if
///
/// * it has fewer than [`MIN_BONES`] bones,
/// * its stature is outside [`STATURES`], or differs by more than 28 % from the stature that follows from the learned lengths, or
/// * more than half of its bones are impossible.
///
/// Otherwise, the worst joint of an impossible bone is dropped, until all remaining bones are possible. The worst joint is the one that
/// also makes other bones impossible. In a tie, it is the joint farther from the trunk, and after that, the joint with the larger
/// covariance.
///
/// These are impossible:
///
/// * a bone whose length is more than [`LIMIT`] standard deviations from the length expected for the stature, or from the
///   learned length;
/// * the left and right bones of a kind, if one is more than [`LIMIT`] standard deviations longer than the other;
/// * two joints connected only through missing joints, if they are farther apart than the bones between them reach.
///
/// * `lengths`: the person's own bone lengths, if known.
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
    /// Standard deviation of the length, in metres.
    pub(crate) spread: f64,
}

/// Returns the expected length of a kind of bone: the learned length if there is one, otherwise the mean length of people of this stature.
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

/// The bones of a skeleton, compared with their expected lengths.
struct Judgement<'a> {
    stature: Option<Stature>,
    lengths: [Option<f64>; N_BONES],
    /// Deviation of every bone's length from the expected length, in standard deviations.
    z: [Option<f64>; N_BONES],
    learned: Option<&'a Lengths>,
    /// Stature from which the expected lengths are derived, in metres; limited to the statures of people.
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

    /// Returns the reason why the skeleton cannot be a person's, regardless of its proportions.
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

    /// Returns the minimum and maximum possible stature, in metres. These are the limits for all people, narrowed to values near the
    /// stature that follows from the learned lengths of the present bones.
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

    /// Returns the joint to drop; `None` if all present joints are possible.
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

    /// Returns the sum of the deviations of the bones that end at a joint.
    fn strain(&self, joint: usize) -> f64 {
        let of_joint = BONES.iter().zip(&self.z).filter(|bone| bone.0.mask() >> joint & 1 == 1);
        of_joint.filter_map(|bone| *bone.1).map(f64::abs).sum()
    }

    /// Calls `found` for every conflict.
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

    /// Calls `found` for each pair of joints that are too far apart for the bones between them, whose other joints are missing.
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

/// A combination of joints that is impossible.
#[derive(Clone, Copy)]
struct Conflict {
    /// Bit mask of the joints involved: bit `i` is set for joint `i`.
    joints: u32,
    /// Size of the conflict, in standard deviations.
    z: f64,
}

#[cfg(test)]
mod tests;
