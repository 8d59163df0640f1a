//! A training: passes over samples until the validation does not improve any more, with a checkpoint after
//! each.

use fastrand::Rng;
use serde::{Deserialize, Serialize};
use skeleton::N_PARTS;
use viewquality::{Card, EVIDENCE_VERSION, Normalisation, TileShape, n_evidence};

use crate::judge::{self, Judgement};
use crate::learn::{Batch, Learner, Step};
use crate::network::{Kind, VGG16};
use crate::onnx;
use crate::parameters::{self, Inputs, Parameter};
use crate::passes::Pass;
use crate::sample::Sample;
use crate::settings::Settings;
use crate::store::{Samples, StoreError, unwrap, wrap};
use crate::vary::{NetworkSample, plain, varied};

const CHECKPOINT: [u8; 8] = *b"PLXQUALI";

/// The state of a training after a pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    /// Hash of the samples and settings.
    stamp: u64,
    parameters: Vec<Parameter>,
    speeds: Vec<Vec<f32>>,
    passes: Vec<Pass>,
    /// The pass after which the validation was best, from 0, and the parameters then.
    best: Option<(usize, Vec<Parameter>)>,
}

/// Why a training cannot start or resume.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// There are no samples for training, or for validation.
    #[error(
        "{learnt} samples to learn from and {validated} to validate on are too few: there must be several groups"
    )]
    TooFew {
        /// To learn from.
        learnt: usize,
        /// To validate on.
        validated: usize,
    },
    /// The samples are of another tile.
    #[error("the samples have tiles of {} x {}, the network sees {} x {}", got[0], got[1], expected[0], expected[1])]
    Tile {
        /// Height and width.
        got: [usize; 2],
        /// Height and width.
        expected: [usize; 2],
    },
    /// The given weights belong to another network.
    #[error("weights for `{name}` are missing, or have another size")]
    Weights {
        /// The parameter.
        name: String,
    },
    /// The checkpoint cannot be read.
    #[error("the checkpoint cannot be used")]
    Checkpoint(#[from] StoreError),
    /// It is of another training.
    #[error("the checkpoint is of a training with other samples or settings")]
    Other,
}

/// A training.
#[derive(Debug)]
pub struct Trainer<'a> {
    settings: &'a Settings,
    tile: TileShape,
    learnt: Vec<&'a Sample>,
    validated: Vec<&'a Sample>,
    inputs: Inputs,
    tau: Vec<f32>,
    state: State,
}

impl<'a> Trainer<'a> {
    /// Prepares a training, from the start or from a checkpoint.
    ///
    /// * `weights`: initial parameters by name; the others are random.
    /// * `checkpoint`: bytes of [`Self::checkpoint`].
    ///
    /// # Errors
    ///
    /// [`TrainError`]
    pub fn new(
        settings: &'a Settings,
        samples: &'a Samples,
        weights: &[Parameter],
        checkpoint: Option<&[u8]>,
    ) -> Result<Self, TrainError> {
        let expected = settings.network.tile().unwrap_or(samples.tile);
        if samples.tile != expected {
            let got = samples.tile;
            return Err(TrainError::Tile { got, expected });
        }
        let (validated, learnt): (Vec<&Sample>, Vec<&Sample>) = samples
            .all
            .iter()
            .partition(|it| is_validated(it, settings));
        if validated.is_empty() || learnt.is_empty() {
            return Err(TrainError::TooFew {
                learnt: learnt.len(),
                validated: validated.len(),
            });
        }
        let inputs = inputs_of(&learnt, samples.tile);
        let stamp = stamp(settings, samples);
        let state = match checkpoint {
            Some(bytes) => {
                let state: State = unwrap(CHECKPOINT, bytes)?;
                if state.stamp != stamp {
                    return Err(TrainError::Other);
                }
                state
            }
            None => begin(settings, &inputs, &learnt, weights, stamp)?,
        };
        let [height, width] = samples.tile;
        Ok(Self {
            settings,
            tile: TileShape { height, width },
            tau: judge::tau(&learnt),
            learnt,
            validated,
            inputs,
            state,
        })
    }

    /// Number of training and of validation samples.
    pub fn n_samples(&self) -> [usize; 2] {
        [self.learnt.len(), self.validated.len()]
    }

    /// The parameters after the last pass.
    pub fn parameters(&self) -> &[Parameter] {
        &self.state.parameters
    }

    /// The passes so far.
    pub fn passes(&self) -> &[Pass] {
        &self.state.passes
    }

    /// The best pass so far, from 0.
    pub fn best(&self) -> Option<usize> {
        self.state.best.as_ref().map(|it| it.0)
    }

    /// Whether the training has finished.
    pub fn is_done(&self) -> bool {
        let n = self.state.passes.len();
        let waited = self.best().map_or(0, |best| n - 1 - best);
        n >= self.settings.epochs as usize || waited >= self.settings.patience as usize
    }

    /// The state as bytes.
    ///
    /// # Errors
    ///
    /// [`StoreError::Encode`]
    pub fn checkpoint(&self) -> Result<Vec<u8>, StoreError> {
        wrap(CHECKPOINT, &self.state)
    }

    /// One pass over the samples, and the validation after it.
    ///
    /// * `go_on`: called before every step, with the steps done and the steps in all; `false` aborts the
    ///   pass.
    /// * Returns whether the pass was finished; if not, nothing has changed.
    pub fn pass(&mut self, go_on: &mut dyn FnMut(usize, usize) -> bool) -> bool {
        let nth = self.state.passes.len();
        let mut dice = Rng::with_seed(
            self.settings.seed ^ (nth as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15),
        );
        let mut order = self.learnt.clone();
        dice.shuffle(&mut order);
        let mut learner = Learner::new(
            self.settings.shape(),
            self.inputs.clone(),
            self.state.parameters.clone(),
            Some(self.state.speeds.clone()),
            frozen(self.settings, nth, &self.state.parameters),
        );
        let n_steps = order.len().div_ceil(self.settings.batch);
        let mut sum = 0.0;
        for (step, samples) in order.chunks(self.settings.batch).enumerate() {
            if !go_on(step, n_steps) {
                return false;
            }
            let seen = |it: &&Sample| {
                let vary = (&self.settings.vary, self.inputs.evidence_mean.as_slice());
                varied(it, (self.tile, self.with_tile()), vary, &mut dice)
            };
            let seen: Vec<NetworkSample> = samples.iter().map(seen).collect();
            let (batch, truth) = self.batch(&seen);
            let step = self.step(nth, step as f32 / n_steps as f32);
            sum += learner.learn(&batch, &truth, step, &mut dice) * samples.len() as f32;
        }
        let learnt = sum / order.len() as f32;
        self.state.parameters = learner.parameters().to_vec();
        self.state.speeds = learner.speeds().to_vec();
        let (validated, area) = self.validate(&learner);
        self.state.passes.push(Pass {
            learnt,
            validated,
            area,
        });
        let best = self.best().map(|it| self.state.passes[it].validated);
        if best.is_none_or(|it| validated < it) {
            self.state.best = Some((nth, self.state.parameters.clone()));
        }
        true
    }

    /// Evaluates the best network so far on samples.
    pub fn judge(&self, samples: &[&Sample]) -> Judgement {
        let learner = self.best_learner();
        let predicted: Vec<Vec<f32>> = self.predict(&learner, samples);
        let unit: viewquality::Unit = self.settings.unit.into();
        let shares = |it: &Vec<f32>| {
            it.iter()
                .map(|it| unit.error(*it, 1.0).unwrap_or(0.0))
                .collect()
        };
        let shares: Vec<Vec<f32>> = predicted.iter().map(shares).collect();
        Judgement::new(&shares, samples, &self.tau)
    }

    /// The validation samples.
    pub fn validated(&self) -> &[&'a Sample] {
        &self.validated
    }

    /// The best network so far as an ONNX file.
    pub fn onnx(&self, identity: &str) -> Vec<u8> {
        let kind = self.settings.network;
        let card = Card {
            tile: kind
                .tile()
                .map(|[height, width]| TileShape { height, width }),
            colours: Normalisation::IMAGENET,
            evidence: kind.sees_evidence().then_some(EVIDENCE_VERSION),
            unit: self.settings.unit.into(),
            identity: identity.to_owned(),
            tau: self.tau.clone(),
        };
        let entries = card.entries().into_iter();
        let entries: Vec<(String, String)> =
            entries.map(|(key, it)| (key.to_owned(), it)).collect();
        onnx::write(
            &self.settings.shape(),
            &self.inputs,
            self.best_parameters(),
            &entries,
        )
    }

    /// The inputs of samples and what the best network predicts for them, in the network's unit.
    pub fn predictions(&self, samples: &[&Sample]) -> Vec<(NetworkSample, Vec<f32>)> {
        let predicted = self.predict(&self.best_learner(), samples);
        let seen = samples
            .iter()
            .map(|it| plain(it, self.tile, self.with_tile()));
        seen.zip(predicted).collect()
    }

    fn best_parameters(&self) -> &[Parameter] {
        let best = self.state.best.as_ref();
        best.map_or(&self.state.parameters, |it| &it.1)
    }

    fn best_learner(&self) -> Learner {
        let parameters = self.best_parameters().to_vec();
        Learner::new(
            self.settings.shape(),
            self.inputs.clone(),
            parameters,
            None,
            0,
        )
    }

    fn with_tile(&self) -> bool {
        self.settings.network.tile().is_some()
    }

    /// Length of a step: rises over the first pass, then falls to 0 as a cosine.
    fn step(&self, pass: usize, within: f32) -> Step {
        let at = pass as f32 + within;
        let share = at / self.settings.epochs as f32;
        let falling = 0.5 * (1.0 + (core::f32::consts::PI * share).cos());
        Step {
            rate: self.settings.rate * falling * at.clamp(0.02, 1.0),
            momentum: self.settings.momentum,
            decay: self.settings.decay,
            longest: self.settings.longest,
            loss: self.settings.loss,
        }
    }

    fn batch(&self, seen: &[NetworkSample]) -> (Batch, Vec<f32>) {
        let evidence = if self.settings.network.sees_evidence() {
            seen.iter()
                .flat_map(|it| it.evidence.iter().copied())
                .collect()
        } else {
            Vec::new()
        };
        let unit: viewquality::Unit = self.settings.unit.into();
        let label = |it: &NetworkSample| -> Vec<f32> {
            let height = f64::from(it.height_px);
            let label = |px: &f32| unit.label(f64::from(*px), height) as f32;
            it.errors_px.iter().map(label).collect()
        };
        let batch = Batch {
            n: seen.len(),
            tiles: seen.iter().flat_map(|it| it.tile.iter().copied()).collect(),
            evidence,
        };
        (batch, seen.iter().flat_map(label).collect())
    }

    /// `[sample][part]`, in the network's unit.
    fn predict(&self, learner: &Learner, samples: &[&Sample]) -> Vec<Vec<f32>> {
        let mut all = Vec::new();
        for samples in samples.chunks(self.settings.batch) {
            let seen: Vec<NetworkSample> = samples
                .iter()
                .map(|it| plain(it, self.tile, self.with_tile()))
                .collect();
            let predicted = learner.predict(&self.batch(&seen).0);
            all.extend(predicted.chunks_exact(N_PARTS).map(<[f32]>::to_vec));
        }
        all
    }

    /// Loss and mean area of the samples that are validated on.
    fn validate(&self, learner: &Learner) -> (f32, f64) {
        let predicted = self.predict(learner, &self.validated);
        let unit: viewquality::Unit = self.settings.unit.into();
        let mut cost = 0.0;
        for (predicted, sample) in predicted.iter().zip(&self.validated) {
            for (predicted, px) in predicted.iter().zip(&sample.errors_px) {
                let label = unit.label(f64::from(*px), f64::from(sample.height_px)) as f32;
                cost += self.settings.loss.of(predicted - label);
            }
        }
        let shares = |it: &Vec<f32>| {
            it.iter()
                .map(|it| unit.error(*it, 1.0).unwrap_or(0.0))
                .collect()
        };
        let shares: Vec<Vec<f32>> = predicted.iter().map(shares).collect();
        let judgement = Judgement::new(&shares, &self.validated, &self.tau);
        (cost / predicted.len() as f32, judgement.mean_area())
    }
}

/// Whether a sample is validated on: by its group alone.
fn is_validated(sample: &Sample, settings: &Settings) -> bool {
    let seed = settings.seed.to_le_bytes();
    let hash = checksum::fnv1a_of(sample.group.bytes().chain(seed));
    // The lowest bits of the hash are the worst.
    (hash >> 40) as f32 / (1_u32 << 24) as f32 <= settings.validation
}

/// Sizes and statistics of the inputs.
fn inputs_of(samples: &[&Sample], tile: [usize; 2]) -> Inputs {
    let (n, width) = (samples.len() as f64, n_evidence(N_PARTS));
    let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(|it| of(it)).sum::<f64>() / n;
    let (mut means, mut deviations) = (Vec::new(), Vec::new());
    for at in 0..width {
        let middle = mean(&|it| f64::from(it.evidence[at]));
        let squared = mean(&|it| (f64::from(it.evidence[at]) - middle).powi(2));
        means.push(middle as f32);
        // A nearly constant value carries no information and is not scaled up.
        deviations.push(squared.sqrt().max(0.05) as f32);
    }
    Inputs {
        tile,
        evidence_mean: means,
        evidence_deviation: deviations,
    }
}

fn stamp(settings: &Settings, samples: &Samples) -> u64 {
    let settings = format!("{settings:?}").into_bytes();
    let of_sample = |it: &Sample| {
        let picture = it.picture.iter().step_by(97).copied();
        let errors = it.errors_px.iter().flat_map(|it| it.to_le_bytes());
        checksum::fnv1a_of(it.source.bytes().chain(picture).chain(errors)).to_le_bytes()
    };
    checksum::fnv1a_of(
        settings
            .into_iter()
            .chain(samples.all.iter().flat_map(of_sample)),
    )
}

/// The state before the first pass: the network predicts the mean of every part.
fn begin(
    settings: &Settings,
    inputs: &Inputs,
    samples: &[&Sample],
    weights: &[Parameter],
    stamp: u64,
) -> Result<State, TrainError> {
    let unit: viewquality::Unit = settings.unit.into();
    let label = |it: &&Sample, part: usize| {
        unit.label(f64::from(it.errors_px[part]), f64::from(it.height_px))
    };
    let mean = |part| samples.iter().map(|it| label(it, part)).sum::<f64>() / samples.len() as f64;
    let outputs: Vec<f32> = (0..N_PARTS).map(|part| mean(part) as f32).collect();
    let mut all = parameters::initial(&settings.shape(), inputs, &outputs, settings.seed);
    for weight in weights {
        let fits = |it: &&mut Parameter| it.name == weight.name && it.dims == weight.dims;
        let Some(found) = all.iter_mut().find(fits) else {
            let name = weight.name.clone();
            return Err(TrainError::Weights { name });
        };
        found.values.clone_from(&weight.values);
    }
    Ok(State {
        stamp,
        speeds: all.iter().map(|it| vec![0.0; it.values.len()]).collect(),
        parameters: all,
        passes: Vec::new(),
        best: None,
    })
}

/// How many of the first parameters are frozen in a pass.
fn frozen(settings: &Settings, pass: usize, parameters: &[Parameter]) -> usize {
    if settings.network != Kind::Vgg16 {
        return 0;
    }
    let blocks = if pass < settings.frozen_epochs as usize {
        0
    } else {
        settings.unfrozen_blocks.min(VGG16.len())
    };
    let first = match VGG16.len() - blocks {
        n if n == VGG16.len() => "hidden.weight".to_owned(),
        n => format!("conv{}_1.weight", n + 1),
    };
    parameters
        .iter()
        .position(|it| it.name == first)
        .unwrap_or(0)
}
