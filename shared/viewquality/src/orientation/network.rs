//! A network of one hidden layer.

use rayon::prelude::*;

/// Number of outputs: the two components of the evidence.
pub(crate) const N_OUTPUTS: usize = 2;

/// The parameters of a detector. Features are standardised and passed through one hidden layer of rectified linear units,
/// which gives two outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Mean of every feature.
    pub(crate) mean: Vec<f32>,
    /// One over the standard deviation of every feature.
    pub(crate) inverse: Vec<f32>,
    /// Weights of the hidden units, `[unit][feature]`; their biases follow.
    pub(crate) hidden: Vec<f32>,
    pub(crate) hidden_bias: Vec<f32>,
    /// Weights of the outputs, `[output][unit]`; their biases follow.
    pub(crate) output: Vec<f32>,
    pub(crate) output_bias: [f32; N_OUTPUTS],
}

impl Network {
    /// Number of features that the network takes.
    pub fn n_features(&self) -> usize {
        self.mean.len()
    }

    /// Number of hidden units.
    pub fn n_hidden(&self) -> usize {
        self.hidden_bias.len()
    }

    /// Standardises features in place.
    pub(crate) fn standardise(&self, features: &mut [f32]) {
        let numbers = self.mean.iter().zip(&self.inverse);
        for (value, (mean, inverse)) in features.iter_mut().zip(numbers) {
            *value = (*value - mean) * inverse;
        }
    }

    /// The sums of the hidden units before rectification.
    pub(crate) fn sums(&self, features: &[f32]) -> Vec<f32> {
        let rows = self.hidden.chunks_exact(self.n_features().max(1));
        let sums = rows.zip(&self.hidden_bias);
        sums.map(|(row, bias)| dot(row, features) + bias).collect()
    }

    /// The outputs for rectified hidden units.
    pub(crate) fn outputs(&self, units: &[f32]) -> [f32; N_OUTPUTS] {
        let rows = self.output.chunks_exact(self.n_hidden().max(1));
        let mut outputs = self.output_bias;
        for (output, row) in outputs.iter_mut().zip(rows) {
            *output += dot(row, units);
        }
        outputs
    }

    /// The outputs for standardised features.
    pub(crate) fn run(&self, features: &[f32]) -> [f32; N_OUTPUTS] {
        let mut units = self.sums(features);
        for unit in &mut units {
            *unit = unit.max(0.0);
        }
        self.outputs(&units)
    }

    /// Calls a function for the weights of every hidden unit, with rows in parallel.
    pub(crate) fn for_each_unit(
        &mut self,
        steps: &mut [f32],
        change: impl Fn(usize, &mut [f32], &mut [f32], &mut f32) + Sync,
    ) {
        let n = self.n_features().max(1);
        let rows = self.hidden.par_chunks_mut(n).zip(steps.par_chunks_mut(n));
        let biases = self.hidden_bias.par_iter_mut();
        rows.zip(biases)
            .enumerate()
            .for_each(|(unit, ((row, step), bias))| change(unit, row, step, bias));
    }
}

/// The scalar product, summed in the same order on every machine.
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 16;
    let mut sums = [0.0_f32; LANES];
    let (whole_a, rest_a) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest = rest_a.iter().zip(rest_b).map(|(a, b)| a * b);
    sums.iter().sum::<f32>() + rest.sum::<f32>()
}
