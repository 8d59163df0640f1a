//! Runs and trains the network: in Rust with burn, or on `LibTorch`.

mod flex;
#[cfg(feature = "libtorch")]
mod torch;

use crate::network::{STRIDE, Shape};
use crate::parameters::{Parameter, Role};
use crate::settings::{Backend, Precision};

/// Decay of the running means of gradients and of their squares (`AdamW`: Loshchilov and Hutter 2019).
const DECAYS: [f32; 2] = [0.9, 0.999];
/// Added to the root of the mean square of a gradient.
const EPSILON: f32 = 1e-8;

/// What some samples show, and what should be found in them.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    /// How many samples.
    pub n: usize,
    /// Width and height of the pictures.
    pub sides: [usize; 2],
    /// `[n, 3, height, width]`.
    pub pictures: Vec<f32>,
    /// Heat of every joint, 0 to 1: `[n, joints, rows, columns]`.
    pub maps: Vec<f32>,
    /// How much the map of every joint counts: `[n, joints]`.
    pub weights: Vec<f32>,
    /// The direction of the trunk, of a length from 0 to 1, its certainty: `[n, 2]`.
    pub fronts: Vec<f32>,
    /// Where the joints are, cells of the maps, NaN where that is not certain: `[n, joints, 2]`.
    pub places: Vec<f32>,
}

/// What the network found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// Log-odds: `[n, joints, rows, columns]`.
    pub maps: Vec<f32>,
    /// `[n, 2]`
    pub fronts: Vec<f32>,
    /// Natural logarithms of expected errors, heights of the input: `[n, joints]`.
    pub errors: Vec<f32>,
}

/// How one step changes the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Length of the step.
    pub rate: f32,
    /// Share of every weight that is taken away, times the rate.
    pub decay: f32,
    /// Longer gradients are scaled to this length.
    pub longest: f32,
    /// Share of the mean of the parameters that every step replaces.
    pub averaged: f32,
    /// What the direction counts beside the maps.
    pub front: f32,
    /// What the expected error counts beside the maps.
    pub error: f32,
    /// Whether only the expected error is learned.
    pub error_only: bool,
}

/// The parts of the cost of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cost {
    /// Of the maps.
    pub maps: f32,
    /// Of the direction, nats a person of certain direction.
    pub front: f32,
    /// Of the expected errors.
    pub error: f32,
}

/// Everything that learning changes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Memory {
    /// The parameters.
    parameters: Vec<Parameter>,
    /// Their mean over the last steps.
    averages: Vec<Parameter>,
    /// Running mean of the gradients.
    first: Vec<Vec<f32>>,
    /// Running mean of their squares.
    second: Vec<Vec<f32>>,
    /// Steps done.
    steps: u64,
}

impl Memory {
    /// At the beginning.
    pub fn new(parameters: Vec<Parameter>) -> Self {
        let zeros = || -> Vec<Vec<f32>> {
            let each = parameters.iter();
            each.map(|it| vec![0.0; it.values.len()]).collect()
        };
        Self {
            averages: parameters.clone(),
            first: zeros(),
            second: zeros(),
            parameters,
            steps: 0,
        }
    }

    /// The mean of the parameters over the last steps: what the network is used with.
    pub fn averages(&self) -> &[Parameter] {
        &self.averages
    }

    /// Begins anew from the averaged parameters.
    #[must_use]
    pub fn restarted(self) -> Self {
        Self::new(self.averages)
    }
}

/// A network that learns by gradient descent (`AdamW`).
///
/// Its whole state is in its [`Memory`]; on one kind of machine, with one number of threads, equal states give equal bits.
#[derive(Debug)]
pub struct Learner {
    shape: Shape,
    backend: Backend,
    precision: Precision,
    memory: Memory,
}

impl Learner {
    /// Creates a learner.
    pub fn new(shape: Shape, (backend, precision): (Backend, Precision), memory: Memory) -> Self {
        Self {
            shape,
            backend,
            precision,
            memory,
        }
    }

    /// What it has learned.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// What it has learned, at the end.
    pub fn into_memory(self) -> Memory {
        self.memory
    }

    /// What the averaged network finds in pictures, `[n, 3, height, width]`.
    pub fn find(&self, n: usize, pictures: &[f32]) -> Found {
        let network = self.network(&self.memory.averages);
        match self.backend {
            Backend::Flex => flex::find(network, n, pictures),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => torch::find(network, n, pictures),
        }
    }

    /// One training step.
    ///
    /// * Returns the cost before it.
    pub fn learn(&mut self, batch: &Batch, step: Step) -> Cost {
        let network = self.network(&self.memory.parameters);
        let (gradients, cost) = match self.backend {
            Backend::Flex => flex::gradients(network, batch, step),
            #[cfg(feature = "libtorch")]
            Backend::LibTorch => torch::gradients(network, batch, step),
        };
        self.change(&gradients, step);
        cost
    }

    fn network<'a>(&'a self, parameters: &'a [Parameter]) -> Network<'a> {
        Network {
            shape: &self.shape,
            precision: self.precision,
            parameters,
        }
    }

    /// Changes the parameters; a gradient that is not finite changes nothing.
    fn change(&mut self, gradients: &[Option<Vec<f32>>], step: Step) {
        let squared: f64 = gradients
            .iter()
            .flatten()
            .flatten()
            .map(|it| f64::from(*it).powi(2))
            .sum();
        let length = squared.sqrt() as f32;
        if !length.is_finite() {
            return;
        }
        let shorten = (step.longest / length).min(1.0);
        let memory = &mut self.memory;
        memory.steps += 1;
        let nth = memory.steps.min(1_000_000) as i32;
        let [first, second] = DECAYS.map(|it| 1.0 - it.powi(nth));
        for (at, gradient) in gradients.iter().enumerate() {
            let Some(gradient) = gradient else {
                continue;
            };
            let parameter = &mut memory.parameters[at];
            let is_weight = parameter.role == Role::Weight;
            let keep = if is_weight {
                1.0 - step.rate * step.decay
            } else {
                1.0
            };
            let means = memory.first[at].iter_mut().zip(&mut memory.second[at]);
            let averages = &mut memory.averages[at].values;
            let values = parameter.values.iter_mut().zip(averages);
            for (((value, average), (mean, square)), gradient) in values.zip(means).zip(gradient) {
                let gradient = gradient * shorten;
                *mean += (1.0 - DECAYS[0]) * (gradient - *mean);
                *square += (1.0 - DECAYS[1]) * (gradient * gradient - *square);
                let direction = (*mean / first) / ((*square / second).sqrt() + EPSILON);
                *value = *value * keep - step.rate * direction;
                *average += step.averaged * (*value - *average);
            }
        }
    }
}

/// A network with its parameters.
#[derive(Clone, Copy)]
struct Network<'a> {
    shape: &'a Shape,
    precision: Precision,
    parameters: &'a [Parameter],
}

/// Of every parameter, nothing of those that are not learned.
type Gradients = Vec<Option<Vec<f32>>>;

impl Step {
    /// Whether the step changes a parameter.
    fn learns(&self, parameter: &Parameter) -> bool {
        !self.error_only || parameter.name.starts_with("error")
    }
}

impl Batch {
    /// How much all maps count.
    fn sum_of_weights(&self) -> f32 {
        self.weights.iter().sum::<f32>().max(1.0)
    }

    /// How certain the direction of every sample is.
    fn certainties(&self) -> Vec<f32> {
        let each = self.fronts.chunks_exact(2);
        each.map(|it| it[0].hypot(it[1])).collect()
    }

    /// How far off the maxima of maps are, heights of the input, 0 where the joint is not certain; 1 where it is and 0 elsewhere.
    fn off(&self, maps: &[f32]) -> [Vec<f32>; 2] {
        let [columns, rows] = self.sides.map(|it| it / STRIDE);
        let known = self.places.chunks_exact(2);
        let off = maps
            .chunks_exact(columns * rows)
            .zip(known)
            .map(|(map, place)| {
                let [x, y] = crate::peak(map, columns);
                (x - place[0]).hypot(y - place[1]) / rows as f32
            });
        let off: Vec<f32> = off.collect();
        let is_known = off.iter().map(|it| f32::from(u8::from(it.is_finite())));
        let is_known = is_known.collect();
        let off = off.iter().map(|it| if it.is_finite() { *it } else { 0.0 });
        [off.collect(), is_known]
    }
}
