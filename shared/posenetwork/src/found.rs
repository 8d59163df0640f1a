//! Joints computed from the output of a network: weighted sums of keypoints, with scores.

use keypoints::{Codec, Keypoint, Score};

use crate::network::{Read, Sight};

/// Standard deviation of the `SimCC` training labels along columns and rows, in bins (mmpose's `RTMPose`, 192x256).
const SIMCC_SIGMA: [f64; 2] = [4.9, 5.66];

/// Returns a keypoint with a score from 0 to 1. For distributions over columns and rows, the score is the likelihood of their highest bins.
pub(crate) fn scored(
    nth: usize,
    keypoint: Keypoint,
    (read, sight): (&Read<'_>, &Sight<'_>),
) -> Keypoint {
    let Read::SimCc(simcc) = read else {
        return keypoint;
    };
    let highest = |axis| {
        let values = likelihood(simcc.axis(nth, axis), axis, sight);
        values.into_iter().fold(0.0, f64::max)
    };
    Keypoint {
        score: highest(0) * highest(1),
        ..keypoint
    }
}

/// Value used where there is no keypoint.
pub(crate) const NOWHERE: Keypoint = Keypoint {
    at: [0.0; 2],
    score: 0.0,
};

/// Weighted sum of keypoints. Its score is the lowest score among them; `None` if one of them was not found.
pub(crate) fn weighted(
    row: &[(usize, f64)],
    found: impl Fn(usize) -> Option<Keypoint>,
) -> Option<Keypoint> {
    let mut sum = Keypoint {
        score: f64::INFINITY,
        ..NOWHERE
    };
    for &(keypoint, weight) in row {
        let it = found(keypoint)?;
        sum.at = [sum.at[0] + weight * it.at[0], sum.at[1] + weight * it.at[1]];
        sum.score = sum.score.min(it.score);
    }
    Some(sum)
}

/// The highest likelihood along an axis, as a fraction of the peak of a training label with the published width; at most 1.
pub(crate) fn likelihood(values: &[f32], axis: usize, sight: &Sight<'_>) -> Vec<f64> {
    let nats = match sight.network().card().output {
        Codec::Simcc { nats, .. } => nats,
        _ => 1.0,
    };
    let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let each = values.iter().map(|value| (nats * f64::from(value - most)).exp());
    let each: Vec<f64> = each.collect();
    let sum: f64 = each.iter().sum();
    let of_label = 1.0 / (SIMCC_SIGMA[axis] * core::f64::consts::TAU.sqrt());
    let share = |value: f64| (value / sum / of_label).min(1.0);
    each.into_iter().map(share).collect()
}

pub(crate) fn score_of(sight: &Sight<'_>) -> Score {
    match sight.network().card().output {
        Codec::HeatMap { score, .. } | Codec::Keypoints { score, .. } => score,
        Codec::Simcc { .. } => Score::Share,
    }
}
