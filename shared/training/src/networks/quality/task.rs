//! The training of a network that predicts errors: passes over samples until the validation stops improving.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use skeleton::N_PARTS;
use viewquality::{Card, EVIDENCE_VERSION, Normalisation, TileShape, n_evidence};

use super::judge::{self, Judgement};
use super::network::{EVIDENCE, Kind, Shape, VGG16};
use super::sample::Sample;
use super::settings::Settings;
use super::store::Samples;
use super::vary::{NetworkSample, plain, varied};
use crate::networks::lesson::Shown;
use crate::networks::onnx::Document;
use crate::networks::optimiser::{Rule, Step};
use crate::networks::order;
use crate::networks::parameters::{self, Parameter};
use crate::networks::training::{Batch, Costed, Plan, Task, Trainer};

/// Results of the network on the validation samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Validated {
    /// Mean loss.
    pub loss: f32,
    /// Mean area under the ROC curve.
    pub area: f64,
}

/// Reason why a training run cannot use its samples or weights.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TaskError {
    /// There are no samples for training, or for validation.
    #[error(
        "{learnt} samples for training and {validated} for validation are too few: there must be several groups"
    )]
    TooFew {
        /// Number of training samples.
        learnt: usize,
        /// Number of validation samples.
        validated: usize,
    },
    /// The samples have tiles of a different size.
    #[error("the samples have tiles of {} x {}, but the network takes {} x {}", got[0], got[1], expected[0], expected[1])]
    Tile {
        /// Height and width in the samples.
        got: [usize; 2],
        /// Height and width that the network takes.
        expected: [usize; 2],
    },
    /// The given weights belong to a different network.
    #[error("weights for `{name}` are missing, or have another size")]
    Weights {
        /// Name of the parameter.
        name: String,
    },
}

/// The training of a network that predicts errors.
#[derive(Debug)]
pub struct QualityTask<'a> {
    settings: &'a Settings,
    tile: TileShape,
    learnt: Vec<&'a Sample>,
    validated: Vec<&'a Sample>,
    begin: Vec<Parameter>,
    /// Mean of every column of the evidence.
    means: Vec<f32>,
    tau: Vec<f32>,
    stamp: u64,
}

impl<'a> QualityTask<'a> {
    /// Prepares a training run.
    ///
    /// * `weights`: initial parameters by name; parameters that are not listed are random.
    ///
    /// # Errors
    ///
    /// Fails with [`TaskError`].
    pub fn new(
        settings: &'a Settings,
        samples: &'a Samples,
        weights: &[Parameter],
    ) -> Result<Self, TaskError> {
        let expected = settings.network.tile().unwrap_or(samples.tile);
        if samples.tile != expected {
            let got = samples.tile;
            return Err(TaskError::Tile { got, expected });
        }
        let all = samples.all.iter();
        let (validated, learnt): (Vec<&Sample>, Vec<&Sample>) =
            all.partition(|sample| is_validated(sample, settings));
        if validated.is_empty() || learnt.is_empty() {
            return Err(TaskError::TooFew {
                learnt: learnt.len(),
                validated: validated.len(),
            });
        }
        let evidence = Columns::new(&learnt);
        let [height, width] = samples.tile;
        Ok(Self {
            settings,
            tile: TileShape { height, width },
            tau: judge::tau(&learnt),
            begin: begin(settings, &learnt, &evidence, weights)?,
            stamp: stamp(settings, samples, weights),
            means: evidence.means,
            learnt,
            validated,
        })
    }

    /// The training samples.
    pub fn learnt(&self) -> &[&'a Sample] {
        &self.learnt
    }

    /// The validation samples.
    pub fn validated(&self) -> &[&'a Sample] {
        &self.validated
    }

    /// Number of steps in a pass over the samples.
    fn steps_of_pass(&self) -> usize {
        self.learnt.len().div_ceil(self.settings.batch)
    }

    /// The pass that a step belongs to (counted from 0), and the fraction of that pass completed at that step.
    fn progress(&self, nth: usize) -> (usize, f32) {
        let steps = self.steps_of_pass();
        (nth / steps, (nth % steps) as f32 / steps as f32)
    }

    fn has_tile(&self) -> bool {
        self.settings.network.tile().is_some()
    }

    fn plain(&self, sample: &Sample) -> NetworkSample {
        plain(sample, self.tile, self.has_tile())
    }

    /// The randomly varied sample with a given number.
    fn sample(&self, number: usize) -> NetworkSample {
        let seed = self.settings.seed;
        let sample = self.learnt[order::shown(number, self.learnt.len(), seed)];
        let vary = (&self.settings.vary, self.means.as_slice());
        let mut dice = order::dice(number, seed);
        varied(sample, (self.tile, self.has_tile()), vary, &mut dice)
    }

    fn shown(&self, seen: &[NetworkSample]) -> Shown {
        let mut inputs = Vec::new();
        if self.has_tile() {
            let tiles = seen.iter().flat_map(|sample| &sample.tile);
            inputs.push(tiles.copied().collect());
        }
        if self.settings.network.sees_evidence() {
            let evidence = seen.iter().flat_map(|sample| &sample.evidence);
            inputs.push(evidence.copied().collect());
        }
        Shown {
            n: seen.len(),
            inputs,
        }
    }

    /// The outputs of a network for samples, `[sample][part]`.
    fn predict(
        &self,
        find: &dyn Fn(&Shown) -> Vec<Vec<f32>>,
        samples: &[&Sample],
    ) -> Vec<Vec<f32>> {
        let mut all = Vec::new();
        for samples in samples.chunks(self.settings.batch) {
            let seen: Vec<NetworkSample> =
                samples.iter().map(|sample| self.plain(sample)).collect();
            let found = find(&self.shown(&seen));
            let found = found.iter().flat_map(|values| values.chunks_exact(N_PARTS));
            all.extend(found.map(<[f32]>::to_vec));
        }
        all
    }

    fn judgement(&self, predicted: &[Vec<f32>], samples: &[&Sample]) -> Judgement {
        let unit: viewquality::Unit = self.settings.unit.into();
        let share = |value: &f32| unit.error(*value, 1.0).unwrap_or(0.0);
        let shares = predicted.iter().map(|values| values.iter().map(share).collect());
        Judgement::new(&shares.collect::<Vec<Vec<f32>>>(), samples, &self.tau)
    }
}

/// Returns the true outputs for the parts of a sample.
fn labels(settings: &Settings, height_px: f32, errors_px: &[f32]) -> Vec<f32> {
    let unit: viewquality::Unit = settings.unit.into();
    let label = |px: &f32| unit.label(f64::from(*px), f64::from(height_px)) as f32;
    errors_px.iter().map(label).collect()
}

impl Task for QualityTask<'_> {
    type Network = Shape;
    /// True outputs, `[n, parts]`.
    type Truth = Vec<f32>;
    type Cost = f32;
    type Score = Validated;

    const LEARNED_FROM: &'static str = "samples";

    fn stamp(&self) -> u64 {
        self.stamp
    }

    fn network(&self) -> Shape {
        self.settings.shape()
    }

    fn begin(&self) -> Vec<Parameter> {
        self.begin.clone()
    }

    fn seed(&self) -> u64 {
        self.settings.seed
    }

    fn n_steps(&self) -> usize {
        self.settings.epochs as usize * self.steps_of_pass()
    }

    fn plan(&self, steps: usize, _: usize) -> Plan {
        let of_pass = self.steps_of_pass();
        Plan {
            steps: of_pass - steps % of_pass,
            is_judged: true,
        }
    }

    /// All parameters are trained, except in the first layers of VGG-16.
    fn learned(&self, nth: usize, parameters: &[Parameter]) -> Vec<bool> {
        let (pass, _) = self.progress(nth);
        let first = first_learned(self.settings, pass);
        let frozen = first.and_then(|first| parameters.iter().position(|list| list.name == first));
        let frozen = frozen.unwrap_or(0);
        let all = parameters.iter().enumerate();
        all.map(|(at, list)| at >= frozen && list.role != parameters::Role::Fixed)
            .collect()
    }

    /// The step length rises over the first pass, then falls to 0 as a cosine.
    fn step(&self, nth: usize) -> Step {
        let settings = self.settings;
        let (pass, within) = self.progress(nth);
        let at = pass as f32 + within;
        let share = at / settings.epochs as f32;
        let falling = 0.5 * (1.0 + (core::f32::consts::PI * share).cos());
        Step {
            rule: Rule::Momentum(settings.momentum),
            rate: settings.rate * falling * at.clamp(0.02, 1.0),
            decay: settings.decay,
            longest: settings.longest,
            averaged: 1.0,
        }
    }

    fn batch(&self, nth: usize) -> Batch<Shape, Vec<f32>> {
        let (n, batch, steps) = (self.learnt.len(), self.settings.batch, self.steps_of_pass());
        let [before, within] = [nth / steps * n, nth % steps * batch];
        let seen: Vec<NetworkSample> = (within..n.min(within + batch))
            .into_par_iter()
            .map(|at| self.sample(before + at))
            .collect();
        let truth = seen
            .iter()
            .flat_map(|seen| labels(self.settings, seen.height_px, &seen.errors_px));
        Batch {
            network: self.network(),
            shown: self.shown(&seen),
            truth: truth.collect(),
        }
    }

    fn cost(&self, _: usize, truth: &Vec<f32>, outputs: &[Vec<f32>]) -> Costed<f32> {
        let loss = self.settings.loss;
        let n = (truth.len() / N_PARTS) as f32;
        let off = || outputs.iter().flatten().zip(truth).map(|(a, b)| a - b);
        Costed {
            cost: off().map(|off| loss.cost(off)).sum::<f32>() / n,
            gradients: vec![off().map(|off| loss.slope(off) / n).collect()],
        }
    }

    fn mean(&self, costs: &[(usize, f32)]) -> f32 {
        let n: usize = costs.iter().map(|(n, _)| n).sum();
        costs.iter().map(|(n, cost)| *n as f32 * cost).sum::<f32>() / n as f32
    }

    fn score(&self, find: &dyn Fn(&Shown) -> Vec<Vec<f32>>) -> Validated {
        let predicted = self.predict(find, &self.validated);
        let mut cost = 0.0;
        for (predicted, sample) in predicted.iter().zip(&self.validated) {
            let labels = labels(self.settings, sample.height_px, &sample.errors_px);
            let off = predicted.iter().zip(labels).map(|(a, b)| a - b);
            cost += off.map(|off| self.settings.loss.cost(off)).sum::<f32>();
        }
        Validated {
            loss: cost / predicted.len() as f32,
            area: self.judgement(&predicted, &self.validated).mean_area(),
        }
    }

    fn rank(&self, score: &Validated) -> Option<f32> {
        Some(score.loss)
    }

    fn is_enough(&self, since: usize) -> bool {
        since >= self.settings.patience as usize
    }
}

impl Trainer<QualityTask<'_>> {
    /// Evaluates the best network so far on samples.
    pub fn judge(&self, samples: &[&Sample]) -> Judgement {
        let predicted = self.task().predict(&|shown| self.find(shown), samples);
        self.task().judgement(&predicted, samples)
    }

    /// The inputs made from samples, and the best network's predictions in its unit.
    pub fn predictions(&self, samples: &[&Sample]) -> Vec<(NetworkSample, Vec<f32>)> {
        let task = self.task();
        let predicted = task.predict(&|shown| self.find(shown), samples);
        let seen = samples.iter().map(|sample| task.plain(sample));
        seen.zip(predicted).collect()
    }

    /// The best network so far as an ONNX file.
    pub fn onnx(&self, identity: &str) -> Vec<u8> {
        let settings = self.task().settings;
        let kind = settings.network;
        let card = Card {
            tile: kind.tile().map(|[height, width]| TileShape { height, width }),
            colours: Normalisation::IMAGENET,
            evidence: kind.sees_evidence().then_some(EVIDENCE_VERSION),
            unit: settings.unit.into(),
            identity: identity.to_owned(),
            tau: self.task().tau.clone(),
        };
        let entries = card.entries().into_iter();
        self.file(Document {
            name: kind.name().to_owned(),
            metadata: entries.map(|(key, value)| (key.to_owned(), value)).collect(),
            has_half_weights: false,
        })
    }
}

/// Returns true if a sample is used for validation, which depends only on its group.
fn is_validated(sample: &Sample, settings: &Settings) -> bool {
    let seed = settings.seed.to_le_bytes();
    let hash = formats::checksum::fnv1a_of(sample.group.bytes().chain(seed));
    // The lowest bits of the hash are the least random.
    (hash >> 40) as f32 / (1_u32 << 24) as f32 <= settings.validation
}

/// Statistics of the columns of the evidence.
struct Columns {
    means: Vec<f32>,
    /// Standard deviations, more than 0.
    deviations: Vec<f32>,
}

impl Columns {
    fn new(samples: &[&Sample]) -> Self {
        let n = samples.len() as f64;
        let mean = |value: &dyn Fn(&Sample) -> f64| {
            samples.iter().map(|sample| value(sample)).sum::<f64>() / n
        };
        let columns = (0..n_evidence(N_PARTS)).map(|at| {
            let middle = mean(&|sample| f64::from(sample.evidence[at]));
            let squared = mean(&|sample| (f64::from(sample.evidence[at]) - middle).powi(2));
            // A nearly constant value carries no information and is not scaled up.
            (middle as f32, squared.sqrt().max(0.05) as f32)
        });
        let (means, deviations) = columns.unzip();
        Self { means, deviations }
    }
}

fn stamp(settings: &Settings, samples: &Samples, weights: &[Parameter]) -> u64 {
    let settings = format!("{settings:?}").into_bytes();
    let of_sample = |sample: &Sample| {
        let picture = sample.picture.iter().step_by(97).copied();
        let errors = sample.errors_px.iter().flat_map(|px| px.to_le_bytes());
        formats::checksum::fnv1a_of(sample.source.bytes().chain(picture).chain(errors))
            .to_le_bytes()
    };
    let weights = weights
        .iter()
        .flat_map(|list| list.values.iter().step_by(97))
        .flat_map(|value| value.to_le_bytes());
    formats::checksum::fnv1a_of(
        settings
            .into_iter()
            .chain(samples.all.iter().flat_map(of_sample))
            .chain(weights),
    )
}

/// The initial parameters. With these, the network predicts the mean error of every part.
fn begin(
    settings: &Settings,
    samples: &[&Sample],
    evidence: &Columns,
    weights: &[Parameter],
) -> Result<Vec<Parameter>, TaskError> {
    let mut means = vec![0.0; N_PARTS];
    for sample in samples {
        let labels = labels(settings, sample.height_px, &sample.errors_px);
        for (mean, label) in means.iter_mut().zip(labels) {
            *mean += f64::from(label) / samples.len() as f64;
        }
    }
    let mut all = parameters::initial(&settings.shape(), settings.seed);
    for parameter in &mut all {
        match parameter.name.strip_prefix(EVIDENCE) {
            Some(".mean") => parameter.values.clone_from(&evidence.means),
            Some(".factor") => {
                let factors = evidence.deviations.iter().map(|deviation| 1.0 / deviation);
                parameter.values = factors.collect();
            }
            _ => (),
        }
    }
    if let [.., weight, bias] = all.as_mut_slice() {
        weight.values.fill(0.0);
        bias.values = means.iter().map(|mean| *mean as f32).collect();
    }
    for weight in weights {
        let fits = |own: &&mut Parameter| own.name == weight.name && own.dims == weight.dims;
        let Some(found) = all.iter_mut().find(fits) else {
            let name = weight.name.clone();
            return Err(TaskError::Weights { name });
        };
        found.values.clone_from(&weight.values);
    }
    Ok(all)
}

/// Name of the first parameter of VGG-16 that a pass trains.
fn first_learned(settings: &Settings, pass: usize) -> Option<String> {
    if settings.network != Kind::Vgg16 {
        return None;
    }
    let blocks = if pass < settings.frozen_epochs as usize {
        0
    } else {
        settings.unfrozen_blocks.min(VGG16.len())
    };
    Some(match VGG16.len() - blocks {
        n if n == VGG16.len() => "hidden.weight".to_owned(),
        n => format!("conv{}_1.weight", n + 1),
    })
}
