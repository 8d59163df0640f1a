//! Estimates a person's stature from the present bones.

use crate::body::Joints;
use crate::body::bone::{self, BONES, N_BONES};
use crate::body::proportion::{Kind, MEASUREMENT_SD};

/// Minimum and maximum stature of a person, in metres.
///
/// The values are our own choice. A child of one or two years, who can hardly stand, is below the minimum (WHO Child Growth Standards 2006:
/// the median at two years is about 0.86 m). Only a handful of living people are above the maximum (ANSUR II: men 1.756 ± 0.069 m, women
/// 1.629 ± 0.064 m).
pub const STATURES: [f64; 2] = [0.80, 2.30];

/// Minimum number of bones for any statement about a person.
pub const MIN_BONES: usize = 4;

/// A standing height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stature {
    /// The height, in metres.
    pub metres: f64,
    /// Standard deviation of the height, in metres.
    pub sd: f64,
}

/// Returns the standing height of a person from the joints, in any posture; `None` if there are fewer than [`MIN_BONES`]
/// bones.
///
/// The height is the median of the estimates from single bones, weighted by their precision, so that one wrong limb has little effect. The
/// uncertainty is the larger of two values: that of a weighted median of independent bones, and that of the observed disagreement.
pub fn stature(joints: &Joints) -> Option<Stature> {
    of_lengths(&bone::lengths(&bone::clean(joints)))
}

/// Like [`stature`], but from the lengths of the bones, in metres.
pub(crate) fn of_lengths(lengths: &[Option<f64>; N_BONES]) -> Option<Stature> {
    let mut sorted = Votes::new(lengths)?;
    let metres = sorted.median();
    let model = 1.0 / sorted.votes().iter().map(|vote| vote[1] * vote[1]).sum::<f64>().sqrt();
    let n = sorted.n as f64;
    for vote in sorted.votes_mut() {
        vote[0] = (vote[0] - metres).abs();
    }
    sorted.sort();
    // The first factor converts a median absolute deviation to a standard deviation, and the division converts this to the standard
    // deviation of a median; both assume a normal distribution.
    let seen = 1.4826 * sorted.median() / n.sqrt();
    let sd = 1.2533 * (model * metres).max(seen);
    Some(Stature { metres, sd })
}

/// Returns only the stature itself (the median), which is needed many times per frame.
pub(crate) fn median_of_lengths(lengths: &[Option<f64>; N_BONES]) -> Option<f64> {
    Votes::new(lengths).map(|votes| votes.median())
}

/// Statures suggested by the bones, in ascending order. The weight of each is the inverse of its relative deviation.
struct Votes {
    votes: [[f64; 2]; N_BONES],
    n: usize,
}

impl Votes {
    fn new(lengths: &[Option<f64>; N_BONES]) -> Option<Self> {
        let mut it = Self {
            votes: [[0.0; 2]; N_BONES],
            n: 0,
        };
        for (bone, length) in BONES.iter().zip(lengths) {
            if let Some(length) = length {
                it.votes[it.n] = [bone.kind.proportion().stature(*length), weight(bone.kind)];
                it.n += 1;
            }
        }
        if it.n < MIN_BONES {
            return None;
        }
        it.sort();
        Some(it)
    }

    fn votes(&self) -> &[[f64; 2]] {
        &self.votes[..self.n]
    }

    fn votes_mut(&mut self) -> &mut [[f64; 2]] {
        &mut self.votes[..self.n]
    }

    fn sort(&mut self) {
        self.votes_mut().sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    }

    /// Returns the value at half of the total weight, interpolated linearly between the centres of the weights.
    fn median(&self) -> f64 {
        let half = 0.5 * self.votes().iter().map(|vote| vote[1]).sum::<f64>();
        let [mut last, mut at_last] = [self.votes[0][0], 0.0];
        let mut sum = 0.0;
        for &[value, weight] in self.votes() {
            let at = sum + 0.5 * weight;
            if at >= half {
                let share = (half - at_last) / (at - at_last);
                return last + share * (value - last);
            }
            sum += weight;
            [last, at_last] = [value, at];
        }
        last
    }
}

/// Returns the weight of a kind of bone in the stature: the inverse of its relative deviation, for a person of 1.7 m.
fn weight(kind: Kind) -> f64 {
    let it = kind.proportion();
    let measured = MEASUREMENT_SD / (it.adult * 1.7);
    1.0 / (it.variance() + measured * measured).sqrt()
}

#[cfg(test)]
mod tests;
