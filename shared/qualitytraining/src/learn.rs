//! Runs and trains networks with burn.

mod forward;

use burn_tensor::{Device, Tensor, TensorData};
use fastrand::Rng;

use self::forward::{BatchStatistics, Forward};
use crate::network::{self, Shape};
use crate::onnx::width_of;
use crate::parameters::{Inputs, Parameter, Role};
use crate::settings::Loss;

/// Share of a running statistic that every batch replaces.
const MOMENTUM_OF_STATISTICS: f32 = 0.05;

/// The inputs of some samples.
#[derive(Debug, Clone, Default)]
pub struct Batch {
    /// How many samples.
    pub n: usize,
    /// `[n, 3, height, width]`; empty for networks without a tile.
    pub tiles: Vec<f32>,
    /// `[n, values]`; empty for networks without evidence.
    pub evidence: Vec<f32>,
}

/// How one step changes the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Length of the step.
    pub rate: f32,
    /// Momentum: share of the last step that is repeated.
    pub momentum: f32,
    /// Share of every weight that is added to its gradient.
    pub decay: f32,
    /// Gradient clipping: longer gradients are scaled to this length.
    pub longest: f32,
    /// Cost.
    pub loss: Loss,
}

/// A network that learns by stochastic gradient descent with momentum.
///
/// Its whole state is in [`parameters`](Self::parameters), [`speeds`](Self::speeds) and the caller's random
/// generator; on the CPU equal states give equal bits.
#[derive(Debug)]
pub struct Learner {
    shape: Shape,
    inputs: Inputs,
    parameters: Vec<Parameter>,
    speeds: Vec<Vec<f32>>,
    /// Parameters before this one are frozen.
    frozen: usize,
    device: Device,
}

impl Learner {
    /// Creates a learner for a network.
    ///
    /// * `speeds`: of an earlier learner; none at the start.
    /// * `frozen`: how many of the first parameters are not trained.
    pub fn new(
        shape: Shape,
        inputs: Inputs,
        parameters: Vec<Parameter>,
        speeds: Option<Vec<Vec<f32>>>,
        frozen: usize,
    ) -> Self {
        let still = || {
            parameters
                .iter()
                .map(|it| vec![0.0; it.values.len()])
                .collect()
        };
        Self {
            speeds: speeds.unwrap_or_else(still),
            shape,
            inputs,
            parameters,
            frozen,
            device: Device::default(),
        }
    }

    /// The parameters.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The last step of every number.
    pub fn speeds(&self) -> &[Vec<f32>] {
        &self.speeds
    }

    /// The output of the network, `[n, parts]`.
    pub fn predict(&self, batch: &Batch) -> Vec<f32> {
        let tensors: Vec<Tensor<1>> = self
            .parameters
            .iter()
            .map(|it| list(&it.values, &self.device))
            .collect();
        let mut forward = self.forward(batch, &self.device, &tensors);
        let output = network::run(&mut forward, &self.shape).list();
        numbers(output.reshape([-1]))
    }

    /// One training step.
    ///
    /// * `truth`: `[n, parts]`.
    /// * Returns the loss before it, the mean over the samples.
    pub fn learn(&mut self, batch: &Batch, truth: &[f32], step: Step, dice: &mut Rng) -> f32 {
        let device = self.device.clone().autodiff();
        let tensors: Vec<Tensor<1>> = (0..)
            .zip(&self.parameters)
            .map(|(at, it)| {
                let tensor = list(&it.values, &device);
                if at < self.frozen || it.role == Role::Fixed {
                    tensor
                } else {
                    tensor.require_grad()
                }
            })
            .collect();
        let mut forward = self.forward(batch, &device, &tensors);
        forward.dice = Some(dice);
        let output = network::run(&mut forward, &self.shape).list();
        let seen = forward.seen;
        let truth = TensorData::new(truth.to_vec(), output.dims());
        let off = output - Tensor::from_data(truth, &device);
        let cost = match step.loss {
            Loss::L2 => (off.clone() * off) * 0.5,
            Loss::Robust => {
                // With c = min(|x|, 1): c |x| - c^2 / 2.
                let size = off.abs();
                let capped = size.clone().clamp_max(1.0);
                capped.clone() * size - capped.clone() * capped * 0.5
            }
        };
        let loss = cost.sum() / batch.n as f32;
        let mut gradients = loss.backward();
        let gradients = tensors.iter().map(|it| it.grad_remove(&mut gradients));
        let gradients: Vec<Option<Vec<f32>>> = gradients.map(|it| it.map(numbers)).collect();
        let squared = gradients
            .iter()
            .flatten()
            .flatten()
            .map(|it| f64::from(*it).powi(2));
        let length = squared.sum::<f64>().sqrt() as f32;
        let factor = if length > step.longest {
            step.longest / length
        } else {
            1.0
        };
        for (at, gradient) in gradients.into_iter().enumerate() {
            if let Some(mut gradient) = gradient {
                for it in &mut gradient {
                    *it *= factor;
                }
                self.change(at, &gradient, step);
            }
        }
        self.remember(seen);
        numbers(loss.reshape([-1]))
            .first()
            .copied()
            .unwrap_or(f32::NAN)
    }

    fn change(&mut self, at: usize, gradient: &[f32], step: Step) {
        let parameter = &mut self.parameters[at];
        let decay = if parameter.role == Role::Weight {
            step.decay
        } else {
            0.0
        };
        let values = parameter.values.iter_mut().zip(&mut self.speeds[at]);
        for ((value, speed), gradient) in values.zip(gradient) {
            *speed = step.momentum * *speed - step.rate * (gradient + decay * *value);
            *value += *speed;
        }
    }

    /// Updates the running statistics of the trained layers.
    fn remember(&mut self, seen: Vec<BatchStatistics>) {
        for BatchStatistics { at, mean, variance } in seen {
            if at < self.frozen {
                continue;
            }
            for (at, seen) in [(at, mean), (at + 1, variance)] {
                let seen = numbers(seen);
                for (value, seen) in self.parameters[at].values.iter_mut().zip(seen) {
                    *value += MOMENTUM_OF_STATISTICS * (seen - *value);
                }
            }
        }
    }

    fn forward<'a>(
        &'a self,
        batch: &Batch,
        device: &'a Device,
        tensors: &'a [Tensor<1>],
    ) -> Forward<'a> {
        let n = batch.n;
        let kind = self.shape.kind;
        let tile = kind.tile().map(|_| {
            let [height, width] = self.inputs.tile;
            Tensor::from_data(
                TensorData::new(batch.tiles.clone(), [n, 3, height, width]),
                device,
            )
        });
        let evidence = kind.sees_evidence().then(|| {
            let width = self.inputs.evidence_mean.len();
            Tensor::from_data(TensorData::new(batch.evidence.clone(), [n, width]), device)
        });
        Forward {
            device,
            parameters: &self.parameters,
            tensors,
            tile,
            evidence,
            width: width_of(self.inputs.tile),
            dice: None,
            next: 0,
            seen: Vec::new(),
        }
    }
}

fn list(values: &[f32], device: &Device) -> Tensor<1> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len()]), device)
}

/// The values of a tensor of `f32`.
fn numbers(of: Tensor<1>) -> Vec<f32> {
    of.into_data_as::<f32>().try_into_vec().unwrap_or_default()
}
