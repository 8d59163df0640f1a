//! Parts that the trainings of the networks that find people and joints have in common: averages of steps, regular evaluations, ONNX files
//! with weights in half precision.

use core::fmt::Debug;

use formats::checksum::fnv1a;

use crate::networks::lesson::Shown;
use crate::networks::onnx::Document;
use crate::networks::parameters::Parameter;
use crate::networks::training::Plan;

/// Number of samples that are evaluated at once.
pub(crate) const JUDGED_AT_ONCE: usize = 32;
/// Number of steps in a pass.
const STEPS: usize = 100;
/// Number of passes between two evaluations on held-out samples.
const JUDGED: usize = 10;

/// There are no training samples, or no held-out samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{learnt} {learned_from} for training and {kept} held out are too few")]
pub struct TooFew {
    /// Name of the samples, such as `people`.
    pub learned_from: &'static str,
    /// Number of training samples.
    pub learnt: usize,
    /// Number of held-out samples.
    pub kept: usize,
}

/// Information for a card about the training.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About<S> {
    /// Number of training examples and of held-out examples.
    pub examples: [usize; 2],
    /// Number of samples used for training.
    pub samples: usize,
    /// True if the training started from a previously trained network.
    pub goes_on: bool,
    /// Quality of the network on the held-out examples.
    pub score: S,
}

/// Checks that there are training samples and held-out samples.
pub(crate) fn check(learned_from: &'static str, [learnt, kept]: [usize; 2]) -> Result<(), TooFew> {
    if learnt == 0 || kept == 0 {
        return Err(TooFew {
            learned_from,
            learnt,
            kept,
        });
    }
    Ok(())
}

/// Returns the description of an ONNX file with weights in half precision.
pub(crate) fn document(name: &str, metadata: &[(String, String)]) -> Document {
    Document {
        name: name.to_owned(),
        metadata: metadata.to_vec(),
        has_half_weights: true,
    }
}

/// Returns the next pass, if `left` steps and then an evaluation remain.
pub(crate) fn plan(left: usize, passes: usize) -> Plan {
    Plan {
        steps: left.min(STEPS),
        is_judged: left <= STEPS || (passes + 1).is_multiple_of(JUDGED),
    }
}

/// Returns the weight of the parameters after a step in their average.
///
/// * `averaged`: as in the settings. At the beginning of the training, there are only a few steps to average.
pub(crate) fn averaged(nth: usize, averaged: f32) -> f32 {
    averaged.max(1.0 / (nth as f32 + 2.0))
}

/// Returns the mean of a part of the costs of several steps.
pub(crate) fn mean<C>(costs: &[(usize, C)], part: impl Fn(&C) -> f32) -> f32 {
    costs.iter().map(|(_, cost)| part(cost)).sum::<f32>() / costs.len().max(1) as f32
}

/// Returns the input of a network for the pictures of samples.
pub(crate) fn shown<S>(seen: &[S], picture: fn(&S) -> &Vec<f32>) -> Shown {
    Shown {
        n: seen.len(),
        inputs: vec![seen.iter().flat_map(picture).copied().collect()],
    }
}

/// Returns the hash of everything that the result depends on.
///
/// * `samples`: hash of the pixels, and truth, of every sample.
pub(crate) fn stamp(
    settings: &impl Debug,
    samples: impl Iterator<Item = (u64, String)>,
    from: Option<&[Parameter]>,
) -> u64 {
    let mut bytes = format!("{settings:?}").into_bytes();
    for (pixels, truth) in samples {
        bytes.extend(pixels.to_le_bytes());
        bytes.extend(truth.into_bytes());
    }
    let from = from.into_iter().flatten();
    for value in from.flat_map(|list| &list.values) {
        bytes.extend(value.to_bits().to_le_bytes());
    }
    fnv1a(&bytes)
}
