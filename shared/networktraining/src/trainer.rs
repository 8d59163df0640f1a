//! A training: steps over people, a look at people who are kept apart now and then, a state that can be kept.

use checksum::{Envelope, EnvelopeError};
use fastrand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::learn::{Batch, Cost, Found, Learner, Memory, Step};
use crate::network::{N_JOINTS, Shape};
use crate::parameters::{Parameter, initial};
use crate::person::Person;
use crate::score::{Judged, Score};
use crate::settings::{Backend, Settings};
use crate::vary::{NetworkSample, plain, varied};
use crate::{onnx, peak};

const CHECKPOINT: Envelope = Envelope {
    magic: *b"PLXPOSNT",
    version: 2,
};
/// People in a row that belong together.
const RUN: usize = 16;
/// People that are judged at once.
const JUDGED_AT_ONCE: usize = 32;
/// Share of the steps in which their length rises.
const RISING: f32 = 0.1;
/// Length of the steps that learn the expected error alone.
const ERROR_RATE: f32 = 3e-4;

/// What some steps of a training came to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Steps done after them.
    pub step: usize,
    /// Their mean cost.
    pub cost: Cost,
    /// How good the averaged network is on half of the people who are kept apart; the expected error is learned on the others.
    pub score: Option<Score>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    /// Hash of the people and settings.
    stamp: u64,
    memory: Memory,
    step: usize,
    passes: Vec<Pass>,
}

/// People who are kept apart: the expected error is learned on some of them and judged on the others, with everything else.
#[derive(Debug)]
struct Kept<'a> {
    calibrating: Vec<&'a Person>,
    judged: Vec<&'a Person>,
}

impl<'a> Kept<'a> {
    /// In turn [`RUN`] for the one and for the other: neighbours in a list can be pictures of one person. All for both where
    /// they are too few.
    fn of(people: &'a [Person]) -> Self {
        let (calibrating, judged): (Vec<_>, Vec<_>) = people
            .iter()
            .enumerate()
            .partition(|(at, _)| (at / RUN).is_multiple_of(2));
        let people_of = |numbered: Vec<(usize, &'a Person)>| -> Vec<&'a Person> {
            numbered.into_iter().map(|(_, person)| person).collect()
        };
        if judged.len() < RUN {
            let all: Vec<&Person> = people.iter().collect();
            return Self {
                calibrating: all.clone(),
                judged: all,
            };
        }
        Self {
            calibrating: people_of(calibrating),
            judged: people_of(judged),
        }
    }
}

/// Why a training cannot start or resume.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// There is nobody to learn from, or nobody is kept apart.
    #[error("{learnt} people to learn from and {kept} kept apart are too few")]
    TooFew {
        /// To learn from.
        learnt: usize,
        /// Kept apart.
        kept: usize,
    },
    /// The checkpoint is not one, or was changed.
    #[error("the checkpoint cannot be used")]
    Checkpoint(#[from] EnvelopeError),
    /// The checkpoint is of another program.
    #[error("the checkpoint cannot be read")]
    Decode(#[from] bincode::error::DecodeError),
    /// It is of another training.
    #[error(
        "the checkpoint is of a training with other people or settings, or from another network"
    )]
    Other,
}

/// A training.
#[derive(Debug)]
pub struct Trainer<'a> {
    settings: &'a Settings,
    backend: Backend,
    learnt: Vec<&'a Person>,
    kept: Kept<'a>,
    state: State,
}

impl<'a> Trainer<'a> {
    /// Prepares a training, from the start or from a checkpoint.
    ///
    /// * `learnt`, `kept`: people to learn from, and others, on whom it is judged and on whom the expected error is learned.
    /// * `from`: the parameters of [`begun`](crate::begun) to begin with, in place of random ones.
    /// * `checkpoint`: bytes of [`Self::checkpoint`].
    ///
    /// # Errors
    ///
    /// [`TrainError`]
    pub fn new(
        (settings, backend): (&'a Settings, Backend),
        [learnt, kept]: [&'a [Person]; 2],
        from: Option<Vec<Parameter>>,
        checkpoint: Option<&[u8]>,
    ) -> Result<Self, TrainError> {
        if learnt.is_empty() || kept.is_empty() {
            let [learnt, kept] = [learnt.len(), kept.len()];
            return Err(TrainError::TooFew { learnt, kept });
        }
        let stamp = stamp(settings, [learnt, kept], from.as_deref());
        let state = if let Some(bytes) = checkpoint {
            let config = bincode::config::standard();
            let bytes = CHECKPOINT.open(bytes)?;
            let (state, _): (State, usize) = bincode::serde::decode_from_slice(bytes, config)?;
            if state.stamp != stamp {
                return Err(TrainError::Other);
            }
            state
        } else {
            let begin = || initial(&settings.shape, settings.seed);
            State {
                stamp,
                memory: Memory::new(from.unwrap_or_else(begin)),
                step: 0,
                passes: Vec::new(),
            }
        };
        Ok(Self {
            settings,
            backend,
            learnt: learnt.iter().collect(),
            kept: Kept::of(kept),
            state,
        })
    }

    /// Steps of the whole training.
    pub fn n_steps(&self) -> usize {
        self.settings.steps + self.settings.error_steps
    }

    /// Steps done.
    pub fn step(&self) -> usize {
        self.state.step
    }

    /// What was reached so far.
    pub fn passes(&self) -> &[Pass] {
        &self.state.passes
    }

    /// The averaged parameters.
    pub fn averages(&self) -> &[Parameter] {
        self.state.memory.averages()
    }

    /// The state as bytes.
    ///
    /// # Errors
    ///
    /// It cannot be written as bytes.
    pub fn checkpoint(&self) -> Result<Vec<u8>, bincode::error::EncodeError> {
        let bytes = bincode::serde::encode_to_vec(&self.state, bincode::config::standard())?;
        Ok(CHECKPOINT.seal(&bytes))
    }

    /// Some steps.
    ///
    /// * `judge`: whether the network is judged after them.
    /// * `go_on`: called before every step, with the steps done; `false` aborts.
    /// * Returns whether they were finished; if not, nothing has changed.
    pub fn pass(
        &mut self,
        steps: usize,
        judge: bool,
        go_on: &mut dyn FnMut(usize) -> bool,
    ) -> bool {
        let from = self.state.step;
        let until = (from + steps).min(self.n_steps());
        let mut memory = self.state.memory.clone();
        if from == self.settings.steps {
            memory = memory.restarted();
        }
        let mut learner = self.learner(memory);
        let mut sum = Cost::default();
        for nth in from..until {
            // What learns the expected error alone begins anew.
            if nth == self.settings.steps && nth > from {
                learner = self.learner(learner.into_memory().restarted());
            }
            if !go_on(nth) {
                return false;
            }
            let batch = self.batch(nth);
            let cost = learner.learn(&batch, self.how(nth));
            sum.maps += cost.maps;
            sum.front += cost.front;
            sum.error += cost.error;
        }
        let n = (until - from).max(1) as f32;
        let cost = Cost {
            maps: sum.maps / n,
            front: sum.front / n,
            error: sum.error / n,
        };
        let score = judge.then(|| score(&learner, self.settings, &self.kept.judged));
        self.state.memory = learner.into_memory();
        self.state.step = until;
        self.state.passes.push(Pass {
            step: until,
            cost,
            score,
        });
        true
    }

    /// How good the averaged network is on people.
    pub fn judge(&self, people: &[Person]) -> Score {
        score(
            &self.learner(self.state.memory.clone()),
            self.settings,
            &people.iter().collect::<Vec<&Person>>(),
        )
    }

    /// What the averaged network finds in pictures.
    ///
    /// * `pictures`: `[n, 3, height, width]`.
    pub fn find(&self, n: usize, pictures: &[f32]) -> Found {
        self.learner(self.state.memory.clone()).find(n, pictures)
    }

    /// The averaged network as an ONNX file.
    pub fn onnx(&self, metadata: &[(String, String)]) -> Vec<u8> {
        onnx::write(&self.settings.shape, self.averages(), metadata)
    }

    fn learner(&self, memory: Memory) -> Learner {
        let numbers = (self.backend, self.settings.precision);
        Learner::new(self.settings.shape.clone(), numbers, memory)
    }

    /// The length of a step rises, then falls to 0 as a cosine.
    fn how(&self, nth: usize) -> Step {
        let settings = self.settings;
        let error_only = nth >= settings.steps;
        let done = (nth as f32 + 0.5) / settings.steps as f32;
        let rate = if error_only {
            ERROR_RATE
        } else if done < RISING {
            settings.rate * done / RISING
        } else {
            let falling = (done - RISING) / (1.0 - RISING);
            settings.rate * 0.5 * (1.0 + (core::f32::consts::PI * falling).cos())
        };
        Step {
            rate,
            decay: settings.decay,
            longest: settings.longest,
            // At the beginning a mean over few steps.
            averaged: settings.averaged.max(1.0 / (nth as f32 + 2.0)),
            front: settings.front,
            error: settings.error,
            error_only,
        }
    }

    /// The network with the size of the input at a step.
    fn shown(&self, nth: usize) -> Shape {
        let settings = self.settings;
        if (nth as f32) < settings.small * settings.steps as f32 {
            settings.shape.smaller()
        } else {
            settings.shape.clone()
        }
    }

    /// The samples of a step: they follow from its number alone.
    fn batch(&self, nth: usize) -> Batch {
        let people = if nth < self.settings.steps {
            &self.learnt
        } else {
            &self.kept.calibrating
        };
        let n = self.settings.batch;
        let shape = self.shown(nth);
        let seen: Vec<NetworkSample> = (0..n)
            .into_par_iter()
            .filter_map(|at| self.sample(people, nth * n + at, &shape))
            .collect();
        batch_of(&seen, &shape)
    }

    /// The sample with a number: everybody once before anybody twice.
    fn sample(&self, people: &[&Person], at: usize, shape: &Shape) -> Option<NetworkSample> {
        let (settings, seed) = (self.settings, self.settings.seed);
        let [pass, place] = [at / people.len(), at % people.len()];
        let person = shuffled(place, people.len(), seed.wrapping_add(pass as u64));
        let mut rng = Rng::with_seed(seed ^ (at as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let other = people[rng.usize(0..people.len())];
        varied(people[person], other, (shape, &settings.vary), &mut rng)
    }
}

/// The number at a place of a random order of `0..n`.
///
/// A Feistel network over the next power of 4, walked until it is within `n`: no list has to be kept.
fn shuffled(place: usize, n: usize, seed: u64) -> usize {
    let half = (usize::BITS - (n.max(2) - 1).leading_zeros()).div_ceil(2);
    let mask = (1usize << half) - 1;
    let mut at = place;
    loop {
        let [mut left, mut right] = [at >> half, at & mask];
        for round in 0..4u64 {
            let mixed = (right as u64 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
                .wrapping_add(round.wrapping_mul(0xd1b5_4a32_d192_ed03));
            let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 32)) as usize & mask;
            (left, right) = (right, left ^ mixed);
        }
        at = (left << half) | right;
        if at < n {
            return at;
        }
    }
}

fn batch_of(seen: &[NetworkSample], shape: &Shape) -> Batch {
    Batch {
        n: seen.len(),
        sides: [shape.width, shape.height],
        pictures: seen
            .iter()
            .flat_map(|it| it.picture.iter().copied())
            .collect(),
        maps: seen.iter().flat_map(|it| it.maps.iter().copied()).collect(),
        weights: seen.iter().flat_map(|it| it.weights).collect(),
        fronts: seen.iter().flat_map(|it| it.front).collect(),
        places: seen
            .iter()
            .flat_map(|it| it.places.into_iter().flatten())
            .collect(),
    }
}

fn score(learner: &Learner, settings: &Settings, people: &[&Person]) -> Score {
    let [columns, rows] = settings.shape.cells();
    let judged = people.chunks(JUDGED_AT_ONCE).flat_map(|people| {
        let seen: Vec<NetworkSample> = people
            .par_iter()
            .filter_map(|it| plain(it, &settings.shape))
            .collect();
        let batch = batch_of(&seen, &settings.shape);
        let found = learner.find(batch.n, &batch.pictures);
        let each = (0..batch.n).map(|at| judged(&found, &seen[at], (at, columns, rows)));
        each.collect::<Vec<Judged>>()
    });
    Score::of(&judged.collect::<Vec<Judged>>())
}

fn judged(
    found: &Found,
    seen: &NetworkSample,
    (at, columns, rows): (usize, usize, usize),
) -> Judged {
    let cells = columns * rows;
    let map = |joint: usize| {
        let from = (at * N_JOINTS + joint) * cells;
        &found.maps[from..from + cells]
    };
    Judged {
        found: core::array::from_fn(|joint| peak(map(joint), columns)),
        expected: core::array::from_fn(|joint| found.errors[at * N_JOINTS + joint]),
        front: core::array::from_fn(|axis| found.fronts[at * 2 + axis]),
        truth: seen.places,
        facing: seen.front,
    }
}

/// A hash of everything that the result depends on.
fn stamp(settings: &Settings, people: [&[Person]; 2], from: Option<&[Parameter]>) -> u64 {
    let mut bytes = format!("{settings:?}").into_bytes();
    for it in people.into_iter().flatten() {
        bytes.extend(checksum::fnv1a(&it.rgb).to_le_bytes());
        bytes.extend(format!("{:?}{:?}", it.targets, it.front).into_bytes());
    }
    for value in from.into_iter().flatten().flat_map(|it| &it.values) {
        bytes.extend(value.to_bits().to_le_bytes());
    }
    checksum::fnv1a(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffled_order_has_everybody_once() {
        for n in [1, 2, 3, 17, 64, 1000] {
            let mut seen: Vec<usize> = (0..n).map(|it| shuffled(it, n, 5)).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..n).collect::<Vec<usize>>(), "{n}");
        }
        assert_ne!(
            (0..100).map(|it| shuffled(it, 100, 1)).collect::<Vec<_>>(),
            (0..100).map(|it| shuffled(it, 100, 2)).collect::<Vec<_>>()
        );
    }
}
