//! Runs and trains the network with burn.

mod forward;

use burn_tensor::{DType, Device, Tensor, TensorData, activation};

use self::forward::Forward;
use crate::network::{self, N_JOINTS, STRIDE, Shape};
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
    device: Device,
    numbers: DType,
    memory: Memory,
}

impl Learner {
    /// Creates a learner.
    pub fn new(shape: Shape, (backend, precision): (Backend, Precision), memory: Memory) -> Self {
        Self {
            shape,
            device: device(backend),
            numbers: match precision {
                Precision::F32 => DType::F32,
                Precision::Bf16 => DType::BF16,
            },
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
        let tensors = tensors(&self.memory.averages, &self.device);
        let sides = [self.shape.width, self.shape.height];
        let mut forward = self.forward((n, sides, pictures), &tensors, &self.device);
        let found = network::run(&mut forward, &self.shape);
        Found {
            maps: numbers(found.maps.map().cast(DType::F32).reshape([-1])),
            fronts: numbers(found.front.list().reshape([-1])),
            errors: numbers(found.error.list().reshape([-1])),
        }
    }

    /// One training step.
    ///
    /// * Returns the cost before it.
    pub fn learn(&mut self, batch: &Batch, step: Step) -> Cost {
        let device = self.device.clone().autodiff();
        let parameters = &self.memory.parameters;
        let of_error = |it: &Parameter| it.name.starts_with("error");
        let learned = |it: &Parameter| !step.error_only || of_error(it);
        let tensors: Vec<Tensor<1>> = tensors(parameters, &device)
            .into_iter()
            .zip(parameters)
            .map(|(tensor, it)| {
                if learned(it) {
                    tensor.require_grad()
                } else {
                    tensor
                }
            })
            .collect();
        let pictures = (batch.n, batch.sides, batch.pictures.as_slice());
        let mut forward = self.forward(pictures, &tensors, &device);
        let found = network::run(&mut forward, &self.shape);
        let maps = found.maps.map().cast(DType::F32);
        let places: Vec<f32> = numbers(maps.clone().detach().reshape([-1]));
        let targets = Targets {
            batch,
            device: &device,
            cells: batch.sides.map(|it| it / STRIDE),
        };
        let of_maps = targets.of_maps(maps);
        let of_front = targets.of_front(found.front.list());
        let of_error = targets.of_error(found.error.list(), &places);
        let cost = if step.error_only {
            of_error.clone() * step.error
        } else {
            of_maps.clone() + of_front.clone() * step.front + of_error.clone() * step.error
        };
        let mut gradients = cost.backward();
        let gradients: Vec<Option<Vec<f32>>> = tensors
            .iter()
            .map(|it| it.grad_remove(&mut gradients).map(numbers))
            .collect();
        self.change(&gradients, step);
        let [maps, front, error] = [of_maps, of_front, of_error].map(|it| {
            let value = numbers(it.reshape([-1]));
            value.first().copied().unwrap_or(f32::NAN)
        });
        Cost { maps, front, error }
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

    fn forward<'a>(
        &'a self,
        (n, [width, height], pictures): (usize, [usize; 2], &[f32]),
        tensors: &'a [Tensor<1>],
        device: &Device,
    ) -> Forward<'a> {
        let data = TensorData::new(pictures.to_vec(), [n, 3, height, width]);
        Forward {
            parameters: &self.memory.parameters,
            tensors,
            picture: Tensor::from_data(data, device),
            numbers: self.numbers,
            next: 0,
        }
    }
}

/// Where the tensors of a backend live.
fn device(backend: Backend) -> Device {
    match backend {
        Backend::Flex => Device::flex(),
        #[cfg(feature = "libtorch")]
        Backend::LibTorch => Device::libtorch(),
    }
}

fn tensors(parameters: &[Parameter], device: &Device) -> Vec<Tensor<1>> {
    let tensor = |it: &Parameter| {
        Tensor::from_data(
            TensorData::new(it.values.clone(), [it.values.len()]),
            device,
        )
    };
    parameters.iter().map(tensor).collect()
}

/// The values of a tensor of `f32`.
fn numbers(of: Tensor<1>) -> Vec<f32> {
    of.into_data_as::<f32>().try_into_vec().unwrap_or_default()
}

/// What should be found, and the cost of what is found in its place.
struct Targets<'a> {
    batch: &'a Batch,
    device: &'a Device,
    cells: [usize; 2],
}

impl Targets<'_> {
    /// Cross-entropy of the maps, heat counting tenfold: the mean over joints, a cell of heat 1 worth.
    fn of_maps(&self, maps: Tensor<4>) -> Tensor<1> {
        let dims = maps.dims();
        let target: Tensor<4> = self.tensor(&self.batch.maps, dims);
        let weights: Tensor<4> = self.tensor(&self.batch.weights, [dims[0], dims[1], 1, 1]);
        let sum_of_weights = self.batch.weights.iter().sum::<f32>().max(1.0);
        // log(1 + exp(x)) - x t, without overflow.
        let soft = activation::relu(maps.clone()) + ((maps.clone().abs() * -1.0).exp() + 1.0).log();
        let entropy = soft - maps * target.clone();
        (entropy * (target * 9.0 + 1.0) * weights).sum() / (sum_of_weights * 40.0)
    }

    /// Surprise about the direction, weighted by its certainty.
    fn of_front(&self, evidence: Tensor<2>) -> Tensor<1> {
        let fronts = &self.batch.fronts;
        let lengths: Vec<f32> = fronts
            .chunks_exact(2)
            .map(|it| it[0].hypot(it[1]))
            .collect();
        let n = self.batch.n;
        let certain = lengths.iter().sum::<f32>().max(1.0);
        let direction: Tensor<2> = self.tensor(fronts, [n, 2]);
        let lengths: Tensor<2> = self.tensor(&lengths, [n, 1]);
        let ratio = (evidence * direction).sum_dim(1) * 2.0 / (lengths.clone() + 1e-6);
        (activation::softplus(ratio * -1.0, 1.0) * lengths).sum() / certain
    }

    /// Surprise about the errors of the maxima, if they are distributed exponentially with the expected error as mean.
    fn of_error(&self, logarithms: Tensor<2>, maps: &[f32]) -> Tensor<1> {
        let [columns, rows] = self.cells;
        let known = self.batch.places.chunks_exact(2);
        let off = maps
            .chunks_exact(columns * rows)
            .zip(known)
            .map(|(map, place)| {
                let [x, y] = crate::peak(map, columns);
                (x - place[0]).hypot(y - place[1]) / rows as f32
            });
        let off: Vec<f32> = off.collect();
        let is_known: Vec<f32> = off
            .iter()
            .map(|it| f32::from(u8::from(it.is_finite())))
            .collect();
        let off: Vec<f32> = off
            .iter()
            .map(|it| if it.is_finite() { *it } else { 0.0 })
            .collect();
        let n_known = is_known.iter().sum::<f32>().max(1.0);
        let dims = [self.batch.n, N_JOINTS];
        let off: Tensor<2> = self.tensor(&off, dims);
        let is_known: Tensor<2> = self.tensor(&is_known, dims);
        let logarithms = logarithms.clamp(-8.0, 2.0);
        let surprise = off * (logarithms.clone() * -1.0).exp() + logarithms;
        (surprise * is_known).sum() / n_known
    }

    fn tensor<const D: usize>(&self, values: &[f32], dims: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values.to_vec(), dims), self.device)
    }
}
