//! Trains a network by stochastic gradient descent with momentum. The loss is the negative log-likelihood of the true direction versus its
//! opposite.

use fastrand::Rng;
use rayon::prelude::*;

use crate::orientation::features::{Buffers, features, n_features};
use crate::orientation::network::{N_OUTPUTS, Network};
use crate::orientation::tile::{Crop, Tile};

/// A person whose direction is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Tile with the person.
    pub tile: Tile,
    /// The direction in which the person faces: components towards the right of the picture and towards the camera. Its length is at
    /// most 1.
    pub front: [f32; 2],
    /// True for a photograph. Photographs of people seen from behind get a weight with which they count as much in total as all other
    /// photographs.
    pub is_photograph: bool,
}

/// Settings of the training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Number of hidden units.
    pub hidden: usize,
    /// Number of passes over all samples.
    pub passes: usize,
    /// Number of samples per step.
    pub batch: usize,
    /// Initial step length; it falls to 0 as half a cosine.
    pub rate: f32,
    /// Weight decay.
    pub decay: f32,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            hidden: 48,
            passes: 20,
            batch: 64,
            rate: 0.01,
            decay: 2e-3,
            seed: 1,
        }
    }
}

/// Progress of a training run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Number of the finished pass, from 1.
    pub nth: usize,
    /// Number of passes.
    pub of: usize,
    /// Mean loss of the pass, in nats.
    pub loss: f64,
}

/// Share of the features, and share of the hidden units, that are randomly left out in each step (dropout).
const FEATURES_OUT: f32 = 0.15;
const UNITS_OUT: f32 = 0.5;
/// Minimum standard deviation by which a feature is divided.
const MIN_DEVIATION: f32 = 0.02;
/// Number of steps until the full step length is reached.
const WARM_UP: f32 = 200.0;
const MOMENTUM: f32 = 0.9;

/// Trains a network on samples, on rayon's current pool. The result has the same bits for any number of threads.
///
/// * `watch`: called after every pass; ends the training by returning `false`.
/// * Returns `None` if there are no samples or `watch` ended the training.
pub fn train(
    samples: &[Sample],
    settings: &Settings,
    mut watch: impl FnMut(Pass) -> bool,
) -> Option<Network> {
    if samples.is_empty() {
        return None;
    }
    let mut rng = Rng::with_seed(settings.seed);
    let mut trainer = Trainer {
        network: beginning(samples, settings, &mut rng),
        weight_behind: weight_behind(samples),
        hidden_steps: vec![0.0; settings.hidden * n_features()],
        output_steps: vec![0.0; settings.hidden * N_OUTPUTS],
        settings: *settings,
    };
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let n_steps = settings.passes * samples.len().div_ceil(settings.batch.max(1));
    let mut step = 0;
    for pass in 0..settings.passes {
        rng.shuffle(&mut order);
        let mut loss = 0.0;
        for batch in order.chunks(settings.batch.max(1)) {
            let done = step as f32 / n_steps as f32;
            let warm = ((step as f32 + 1.0) / WARM_UP).min(1.0);
            let rate = settings.rate * warm * (1.0 + (std::f32::consts::PI * done).cos()) / 2.0;
            let varied: Vec<(&Sample, Crop, u64)> =
                batch.iter().map(|&at| (&samples[at], vary(&mut rng), rng.u64(..))).collect();
            loss += trainer.step(&varied, rate);
            step += 1;
        }
        let pass = Pass {
            nth: pass + 1,
            of: settings.passes,
            loss: loss / samples.len() as f64,
        };
        if !watch(pass) {
            return None;
        }
    }
    Some(trainer.network)
}

/// Weight of a photograph of a person from behind.
fn weight_behind(samples: &[Sample]) -> f32 {
    let photographs = || samples.iter().filter(|sample| sample.is_photograph);
    let behind = photographs().filter(|photograph| photograph.front[1] < 0.0).count();
    (photographs().count() - behind) as f32 / behind.max(1) as f32
}

/// A network that standardises the features and has random weights.
fn beginning(samples: &[Sample], settings: &Settings, rng: &mut Rng) -> Network {
    let n = n_features();
    let some: Vec<Vec<f32>> = samples
        .par_iter()
        .step_by(7)
        .map_init(Buffers::default, |buffers, sample| {
            let mut out = Vec::new();
            features(&sample.tile, &Crop::default(), buffers, &mut out);
            out
        })
        .collect();
    let share = 1.0 / some.len() as f32;
    let mut mean = vec![0.0; n];
    for values in &some {
        for (mean, value) in mean.iter_mut().zip(values) {
            *mean += value * share;
        }
    }
    let mut variance = vec![0.0; n];
    for values in &some {
        for (variance, (value, mean)) in variance.iter_mut().zip(values.iter().zip(&mean)) {
            *variance += (value - mean).powi(2) * share;
        }
    }
    let inverse = variance
        .iter()
        .map(|variance: &f32| 1.0 / variance.sqrt().max(MIN_DEVIATION))
        .collect();
    let mut normal = |deviation: f32| {
        let radius = (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
        (radius * (std::f64::consts::TAU * rng.f64()).cos()) as f32 * deviation
    };
    let hidden = settings.hidden;
    let of_features = (1.0 / n as f32).sqrt();
    let of_units = (1.0 / hidden as f32).sqrt();
    Network {
        mean,
        inverse,
        hidden: (0..n * hidden).map(|_| normal(of_features)).collect(),
        hidden_bias: vec![0.0; hidden],
        output: (0..N_OUTPUTS * hidden).map(|_| normal(of_units)).collect(),
        output_bias: [0.0; N_OUTPUTS],
    }
}

/// A random crop. It varies as much as boxes, lighting and people usually do.
fn vary(rng: &mut Rng) -> Crop {
    let mut within = |most: f32| most * (2.0 * rng.f32() - 1.0);
    let bright = 1.0 + within(0.35);
    Crop {
        scale: 1.0 + within(0.12),
        shift_px: [within(3.0), within(3.0)],
        gain: [0; 3].map(|_| bright * (1.0 + within(0.1))),
        turn: within(0.15),
        mirrored: rng.bool(),
    }
}

struct Trainer {
    network: Network,
    settings: Settings,
    weight_behind: f32,
    hidden_steps: Vec<f32>,
    output_steps: Vec<f32>,
}

impl Trainer {
    /// Makes one step, and returns the sum of the losses.
    fn step(&mut self, batch: &[(&Sample, Crop, u64)], rate: f32) -> f64 {
        let network = &self.network;
        let inputs: Vec<Vec<f32>> = batch
            .par_iter()
            .map_init(Buffers::default, |buffers, (sample, crop, seed)| {
                let mut values = Vec::new();
                features(&sample.tile, crop, buffers, &mut values);
                network.standardise(&mut values);
                leave_out(&mut values, FEATURES_OUT, *seed);
                values
            })
            .collect();
        let sums: Vec<Vec<f32>> = inputs.par_iter().map(|input| network.sums(input)).collect();
        let hidden = network.n_hidden();
        let mut of_output = vec![0.0; N_OUTPUTS * hidden];
        let mut of_bias = [0.0; N_OUTPUTS];
        // For every sample, the derivative of the loss with respect to the sum of every hidden unit.
        let mut of_sums = vec![vec![0.0; hidden]; batch.len()];
        let mut loss = 0.0;
        for (((sample, crop, seed), sums), of_sums) in batch.iter().zip(&sums).zip(&mut of_sums) {
            let mut kept = vec![1.0; hidden];
            leave_out(&mut kept, UNITS_OUT, seed ^ 0x37);
            let units: Vec<f32> = sums.iter().zip(&kept).map(|(sum, k)| sum.max(0.0) * k).collect();
            let evidence = network.outputs(&units);
            let [right, towards] = sample.front;
            let front = [if crop.mirrored { -right } else { right }, towards];
            let ratio = 2.0 * (evidence[0] * front[0] + evidence[1] * front[1]);
            loss += f64::from((-ratio).exp().ln_1p());
            let weight = if sample.is_photograph && towards < 0.0 {
                self.weight_behind
            } else {
                1.0
            };
            let slope = -weight / self.settings.batch as f32 / (1.0 + ratio.exp());
            for (output, front) in front.iter().enumerate() {
                let by_output = 2.0 * slope * front;
                of_bias[output] += by_output;
                for unit in 0..hidden {
                    let at = output * hidden + unit;
                    of_output[at] += by_output * units[unit];
                    if sums[unit] > 0.0 {
                        of_sums[unit] += by_output * network.output[at] * kept[unit];
                    }
                }
            }
        }
        self.go(rate, &inputs, &of_sums, (&of_output, of_bias));
        loss
    }

    /// Changes all parameters in the direction opposite to their derivatives.
    fn go(
        &mut self,
        rate: f32,
        inputs: &[Vec<f32>],
        of_sums: &[Vec<f32>],
        (of_output, of_bias): (&[f32], [f32; N_OUTPUTS]),
    ) {
        let decay = self.settings.decay;
        let network = &mut self.network;
        let weights = network.output.iter_mut().zip(&mut self.output_steps);
        for ((weight, step), slope) in weights.zip(of_output) {
            *step = MOMENTUM * *step - rate * (slope + decay * *weight);
            *weight += *step;
        }
        for (bias, slope) in network.output_bias.iter_mut().zip(of_bias) {
            *bias -= rate * slope;
        }
        network.for_each_unit(&mut self.hidden_steps, |unit, row, steps, bias| {
            for (step, weight) in steps.iter_mut().zip(row.iter()) {
                *step = MOMENTUM * *step - rate * decay * weight;
            }
            for (input, of_sums) in inputs.iter().zip(of_sums) {
                let slope = rate * of_sums[unit];
                if slope != 0.0 {
                    for (step, value) in steps.iter_mut().zip(input) {
                        *step -= slope * value;
                    }
                    *bias -= slope;
                }
            }
            for (weight, step) in row.iter_mut().zip(steps.iter()) {
                *weight += step;
            }
        });
    }
}

/// Sets a random share of the values to 0, and scales the others so that the expected sum does not change.
fn leave_out(values: &mut [f32], share: f32, seed: u64) {
    let mut rng = Rng::with_seed(seed);
    let limit = (share * 256.0) as u8;
    let factor = 256.0 / (256.0 - f32::from(limit));
    for value in values {
        *value = if rng.u8(..) < limit {
            0.0
        } else {
            *value * factor
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::{Detector, score};

    /// Artificial people: their faces are bright on the side towards which they look, and dark from behind.
    fn made_up(n: u64, seed: u64) -> Vec<Sample> {
        let mut rng = Rng::with_seed(seed);
        let one = |_| {
            let angle = rng.f32() * std::f32::consts::TAU;
            let front = [angle.sin(), angle.cos()];
            let size = crate::orientation::TILE;
            let mut rgb = Vec::new();
            for y in 0..size.height {
                for x in 0..size.width {
                    let place = [x as f32 - 64.0, y as f32 - 40.0];
                    let is_head = place[0].hypot(place[1]) < 14.0;
                    let is_face =
                        is_head && (place[0] - 9.0 * front[0]).abs() < 6.0 && front[1] > -0.3;
                    let value = match (is_head, is_face) {
                        (_, true) => 220,
                        (true, _) => 60,
                        _ => 120,
                    };
                    rgb.extend([0; 3].map(|_| value + rng.u8(..20)));
                }
            }
            let head = [64.0, 40.0];
            Sample {
                tile: Tile { rgb, head },
                front,
                is_photograph: true,
            }
        };
        (0..n).map(one).collect()
    }

    #[test]
    fn visible_orientation_is_learned_and_generalises_to_others() {
        let settings = Settings {
            hidden: 8,
            passes: 6,
            ..Settings::default()
        };
        let network = train(&made_up(300, 1), &settings, |_| true).unwrap();
        let held_out = made_up(100, 2);
        let got = score(&Detector::new(network), &held_out);
        assert!(got.share() > 0.9 && got.surprise < 0.4, "{got:?}");
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let samples = made_up(20, 3);
        let settings = Settings {
            hidden: 4,
            passes: 2,
            ..Settings::default()
        };
        let on = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            pool.unwrap().install(|| train(&samples, &settings, |_| true))
        };
        assert!(on(1) == on(3), "other numbers on three threads");
    }

    #[test]
    fn training_ends_on_request_and_without_samples() {
        assert_eq!(train(&[], &Settings::default(), |_| true), None);
        let mut n = 0;
        let stopped = train(&made_up(4, 1), &Settings::default(), |_| {
            n += 1;
            false
        });
        assert_eq!((stopped, n), (None, 1));
    }
}
