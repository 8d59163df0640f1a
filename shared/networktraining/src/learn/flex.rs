//! Runs and trains the network in Rust, with burn.

mod forward;

use burn_tensor::{DType, Device, Tensor, TensorData, activation};

use self::forward::Forward;
use super::{Batch, Cost, Found, Gradients, Network, Step};
use crate::network::{self, N_JOINTS};
use crate::parameters::Parameter;
use crate::settings::Precision;

/// What a network finds in pictures, `[n, 3, height, width]`.
pub(super) fn find(network: Network<'_>, n: usize, pictures: &[f32]) -> Found {
    let device = Device::flex();
    let tensors = tensors(network.parameters, &device);
    let sides = [network.shape.width, network.shape.height];
    let mut forward = forward(network, (n, sides, pictures), &tensors, &device);
    let found = network::run(&mut forward, network.shape);
    Found {
        maps: numbers(found.maps.map().cast(DType::F32).reshape([-1])),
        fronts: numbers(found.front.list().reshape([-1])),
        errors: numbers(found.error.list().reshape([-1])),
    }
}

/// The gradients of the cost, and the cost.
pub(super) fn gradients(network: Network<'_>, batch: &Batch, step: Step) -> (Gradients, Cost) {
    let device = Device::flex().autodiff();
    let tensors: Vec<Tensor<1>> = tensors(network.parameters, &device)
        .into_iter()
        .zip(network.parameters)
        .map(|(tensor, it)| {
            if step.learns(it) {
                tensor.require_grad()
            } else {
                tensor
            }
        })
        .collect();
    let pictures = (batch.n, batch.sides, batch.pictures.as_slice());
    let mut forward = forward(network, pictures, &tensors, &device);
    let found = network::run(&mut forward, network.shape);
    let maps = found.maps.map().cast(DType::F32);
    let places: Vec<f32> = numbers(maps.clone().detach().reshape([-1]));
    let targets = Targets {
        batch,
        device: &device,
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
    let gradients = tensors
        .iter()
        .map(|it| it.grad_remove(&mut gradients).map(numbers))
        .collect();
    let [maps, front, error] = [of_maps, of_front, of_error].map(|it| {
        let value = numbers(it.reshape([-1]));
        value.first().copied().unwrap_or(f32::NAN)
    });
    (gradients, Cost { maps, front, error })
}

fn forward<'a>(
    network: Network<'a>,
    (n, [width, height], pictures): (usize, [usize; 2], &[f32]),
    tensors: &'a [Tensor<1>],
    device: &Device,
) -> Forward<'a> {
    let data = TensorData::new(pictures.to_vec(), [n, 3, height, width]);
    Forward {
        parameters: network.parameters,
        tensors,
        picture: Tensor::from_data(data, device),
        numbers: match network.precision {
            Precision::F32 => DType::F32,
            Precision::Bf16 => DType::BF16,
        },
        next: 0,
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
}

impl Targets<'_> {
    /// Cross-entropy of the maps, heat counting tenfold: the mean over joints, a cell of heat 1 worth.
    fn of_maps(&self, maps: Tensor<4>) -> Tensor<1> {
        let dims = maps.dims();
        let target: Tensor<4> = self.tensor(&self.batch.maps, dims);
        let weights: Tensor<4> = self.tensor(&self.batch.weights, [dims[0], dims[1], 1, 1]);
        // log(1 + exp(x)) - x t, without overflow.
        let soft = activation::relu(maps.clone()) + ((maps.clone().abs() * -1.0).exp() + 1.0).log();
        let entropy = soft - maps * target.clone();
        (entropy * (target * 9.0 + 1.0) * weights).sum() / (self.batch.sum_of_weights() * 40.0)
    }

    /// Surprise about the direction, weighted by its certainty.
    fn of_front(&self, evidence: Tensor<2>) -> Tensor<1> {
        let lengths = self.batch.certainties();
        let n = self.batch.n;
        let certain = lengths.iter().sum::<f32>().max(1.0);
        let direction: Tensor<2> = self.tensor(&self.batch.fronts, [n, 2]);
        let lengths: Tensor<2> = self.tensor(&lengths, [n, 1]);
        let ratio = (evidence * direction).sum_dim(1) * 2.0 / (lengths.clone() + 1e-6);
        (activation::softplus(ratio * -1.0, 1.0) * lengths).sum() / certain
    }

    /// Surprise about the errors of the maxima, if they are distributed exponentially with the expected error as mean.
    fn of_error(&self, logarithms: Tensor<2>, maps: &[f32]) -> Tensor<1> {
        let [off, is_known] = self.batch.off(maps);
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
