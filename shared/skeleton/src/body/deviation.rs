//! Measures how much a skeleton deviates from a human body, in order to choose among many skeletons.

use crate::body::bone::{self, BONES};
use crate::body::proportion::MEASUREMENT_SD;
use crate::body::stature::median_of_lengths;
use crate::body::{Joints, N_BONES};

/// Maximum number of squared standard deviations that one bone adds to [`deviation`]; the stature adds at most four times
/// this number.
pub const DEVIATION_CAP: f64 = 9.0;

/// Range of statures that add nothing to the deviation, in metres: from a three-year-old child to a man taller than almost all others.
const USUAL: [f64; 2] = [0.95, 2.0];
/// Standard deviation of the stature outside this range, in metres.
const UNUSUAL_SD: f64 = 0.05;
const UNUSUAL_CAP: f64 = 4.0 * DEVIATION_CAP;

/// Returns how much a skeleton deviates from a human body: squared standard deviations, summed over the 14 bones and the stature.
///
/// Every bone adds the squared deviation of the logarithm of its length from that expected for the stature, at most [`DEVIATION_CAP`]. The
/// stature is the one on which the bones agree best; it adds nothing between 0.95 and 2.0 m. A missing bone adds 1, as much as an average
/// bone, so that skeletons with different missing joints can be compared.
///
/// * Returns a number without a unit, from 0 to 18 times the cap; values up to 14 are usual for a person. Half of it is a robust negative
///   log-likelihood. Returns the largest number if there are too few bones for a stature.
pub fn deviation(joints: &Joints) -> f64 {
    let lengths = bone::lengths(&bone::clean(joints));
    let Some(stature) = median_of_lengths(&lengths) else {
        return DEVIATION_CAP * N_BONES as f64 + UNUSUAL_CAP;
    };
    let unusual = (stature - stature.clamp(USUAL[0], USUAL[1])) / UNUSUAL_SD;
    // Near 0, all expected lengths would be 0; this minimum keeps them usable.
    let stature = stature.max(0.1);
    let mut sum = (unusual * unusual).min(UNUSUAL_CAP);
    for (bone, length) in BONES.iter().zip(&lengths) {
        sum += length.map_or(1.0, |length| {
            let proportion = bone.kind.proportion();
            let expected = proportion.length(stature);
            let measured = MEASUREMENT_SD / expected;
            let variance = proportion.variance() + measured * measured;
            let log = (length.max(1e-9) / expected).ln();
            (log * log / variance).min(DEVIATION_CAP)
        });
    }
    sum
}

#[cfg(test)]
mod tests;
