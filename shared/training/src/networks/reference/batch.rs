//! Normalisation over a batch: values and gradients.

use super::matrix::{dot, sum, sum_of};
use super::record::{At, Back, Record, by_sample};
use crate::networks::lesson::Statistics;
use crate::networks::parameters::EPSILON_OF_BATCH;

/// Values for normalising the maps of a batch.
struct Normalisation {
    n: usize,
    /// Number of cells in a channel.
    cells: usize,
    /// Means of the channels.
    means: Vec<f32>,
    /// For each channel, the factor that gives standard deviation 1.
    inverse: Vec<f32>,
}

/// The gradients of scale and shift of every channel.
struct OfParameters {
    scale: Vec<f32>,
    shift: Vec<f32>,
}

impl Normalisation {
    fn new([n, cells]: [usize; 2], means: Vec<f32>, variances: &[f32]) -> Self {
        let inverse = |variance: &f32| 1.0 / (variance + EPSILON_OF_BATCH).sqrt();
        Self {
            n,
            cells,
            means,
            inverse: variances.iter().map(inverse).collect(),
        }
    }

    fn size(&self) -> usize {
        self.means.len() * self.cells
    }

    /// The range of cells of one channel of a sample.
    fn run(&self, sample: usize, channel: usize) -> core::ops::Range<usize> {
        let first = sample * self.size() + channel * self.cells;
        first..first + self.cells
    }

    fn values(&self, from: &[f32], scales: &[f32], shifts: &[f32]) -> Vec<f32> {
        by_sample(self.n, self.size(), |sample, to| {
            for (channel, to) in to.chunks_exact_mut(self.cells).enumerate() {
                let factor = scales[channel] * self.inverse[channel];
                let shift = shifts[channel] - self.means[channel] * factor;
                for (to, from) in to.iter_mut().zip(&from[self.run(sample, channel)]) {
                    *to = from * factor + shift;
                }
            }
        })
    }

    fn of_parameters(&self, from: &[f32], gradient: &[f32]) -> OfParameters {
        let mut of = OfParameters {
            scale: Vec::new(),
            shift: Vec::new(),
        };
        for (channel, (mean, inverse)) in self.means.iter().zip(&self.inverse).enumerate() {
            let runs = (0..self.n).map(|sample| self.run(sample, channel));
            let shift: f32 = runs.clone().map(|run| sum(&gradient[run])).sum();
            let along: f32 = runs.map(|run| dot(&gradient[run.clone()], &from[run])).sum();
            of.scale.push((along - mean * shift) * inverse);
            of.shift.push(shift);
        }
        of
    }

    fn of_map(
        &self,
        [from, gradient, scales]: [&[f32]; 3],
        of_parameters: &OfParameters,
    ) -> Vec<f32> {
        let total = (self.n * self.cells) as f32;
        by_sample(self.n, self.size(), |sample, to| {
            for (channel, to) in to.chunks_exact_mut(self.cells).enumerate() {
                let run = self.run(sample, channel);
                let factor = scales[channel] * self.inverse[channel];
                let slope = of_parameters.scale[channel] * self.inverse[channel] / total;
                let level = of_parameters.shift[channel] / total - slope * self.means[channel];
                let pairs = gradient[run.clone()].iter().zip(&from[run]);
                for (to, (gradient, from)) in to.iter_mut().zip(pairs) {
                    *to = factor * (gradient - level - slope * from);
                }
            }
        })
    }
}

impl<'a> Record<'a> {
    /// Normalises every channel over the batch, or by running statistics if the network is not being trained.
    pub(super) fn normalise(&mut self, map: At, name: &str) -> At {
        let [scale, shift, mean, variance] =
            self.parameters(name, ["scale", "shift", "mean", "variance"]);
        let [n_channels, cells] = self.channels(map);
        let (means, variances) = if self.dice.is_some() {
            let (means, variances) = statistics(self.values(map), [n_channels, cells]);
            self.statistics.push(Statistics {
                at: mean,
                mean: means.clone(),
                variance: variances.clone(),
            });
            (means, variances)
        } else {
            let [mean, variance] = [mean, variance].map(|at| self.of_parameter(at).to_vec());
            (mean, variance)
        };
        let normalisation = Normalisation::new([self.n, cells], means, &variances);
        let [scales, shifts] = [scale, shift].map(|at| self.of_parameter(at));
        let values = normalisation.values(self.values(map), scales, shifts);
        let leads = self.leads(map);
        let back = (leads || self.learns(&[scale, shift])).then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let from = record.values(map);
                let of = normalisation.of_parameters(from, gradient);
                if leads {
                    all.add(map, normalisation.of_map([from, gradient, scales], &of));
                }
                all.of_parameter(scale, of.scale);
                all.of_parameter(shift, of.shift);
            })
        });
        self.record(self.dims(map).to_vec(), values, back)
    }
}

/// Mean and variance of every channel over a batch.
fn statistics(values: &[f32], [channels, cells]: [usize; 2]) -> (Vec<f32>, Vec<f32>) {
    let n = (values.len() / channels) as f32;
    let runs = |channel: usize| values.chunks_exact(cells).skip(channel).step_by(channels);
    let of_channel = |channel: usize| {
        let mean = runs(channel).map(sum).sum::<f32>() / n;
        let squared = |run: &[f32]| sum_of(run, run, |value, _| (value - mean) * (value - mean));
        (mean, runs(channel).map(squared).sum::<f32>() / n)
    };
    (0..channels).map(of_channel).unzip()
}
