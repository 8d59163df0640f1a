//! Runs and trains the network on `LibTorch`, which records the forward pass itself.
//!
//! burn could use `LibTorch`, too, but calculates the gradients of weights by convolutions whose kernels are as large as the maps:
//! a step takes 1.8 times as long. Maps lie here with the channels of a cell side by side, as the convolutions want them.

use std::rc::Rc;

use tch::{Kind, Tensor};

use super::{Batch, Cost, Found, Gradients, Network, Step};
use crate::network::{self, Conv, N_JOINTS, Ops, STRIDE, grid};
use crate::parameters::{EPSILON, GAIN_OF_RELU, Parameter};
use crate::settings::Precision;

/// What a network finds in pictures, `[n, 3, height, width]`.
pub(super) fn find(network: Network<'_>, n: usize, pictures: &[f32]) -> Found {
    tch::no_grad(|| {
        let tensors = tensors(network.parameters, &|_| false);
        let sides = [network.shape.width, network.shape.height];
        let mut forward = Forward::new(network, (n, sides, pictures), &tensors);
        let found = network::run(&mut forward, network.shape);
        Found {
            maps: numbers(&found.maps),
            fronts: numbers(&found.front),
            errors: numbers(&found.error),
        }
    })
}

/// The gradients of the cost, and the cost.
pub(super) fn gradients(network: Network<'_>, batch: &Batch, step: Step) -> (Gradients, Cost) {
    let tensors = tensors(network.parameters, &|it| step.learns(it));
    let pictures = (batch.n, batch.sides, batch.pictures.as_slice());
    let mut forward = Forward::new(network, pictures, &tensors);
    let found = network::run(&mut forward, network.shape);
    let maps = found.maps.to_kind(Kind::Float);
    let places = numbers(&maps.detach());
    let of_maps = of_maps(batch, &maps);
    let of_front = of_front(batch, &found.front);
    let of_error = of_error(batch, &found.error, &places);
    let cost = if step.error_only {
        &of_error * f64::from(step.error)
    } else {
        &of_maps + &of_front * f64::from(step.front) + &of_error * f64::from(step.error)
    };
    cost.backward();
    let gradients = tensors.iter().map(|it| {
        let gradient = it.grad();
        gradient.defined().then(|| numbers(&gradient))
    });
    let [maps, front, error] = [of_maps, of_front, of_error].map(|it| it.double_value(&[]) as f32);
    (gradients.collect(), Cost { maps, front, error })
}

/// Cross-entropy of the maps, heat counting tenfold: the mean over joints, a cell of heat 1 worth.
fn of_maps(batch: &Batch, maps: &Tensor) -> Tensor {
    let [columns, rows] = batch.sides.map(|it| (it / STRIDE) as i64);
    let joints = N_JOINTS as i64;
    let n = batch.n as i64;
    let target = tensor(&batch.maps, &[n, joints, rows, columns]);
    let weights = tensor(&batch.weights, &[n, joints, 1, 1]);
    let weights = weights * (&target * 9.0 + 1.0);
    // log(1 + exp(x)) - x t, without overflow.
    let entropy = maps.softplus() - maps * target;
    (entropy * weights).sum(Kind::Float) / (f64::from(batch.sum_of_weights()) * 40.0)
}

/// Surprise about the direction, weighted by its certainty.
fn of_front(batch: &Batch, evidence: &Tensor) -> Tensor {
    let lengths = batch.certainties();
    let n = batch.n as i64;
    let certain = lengths.iter().sum::<f32>().max(1.0);
    let direction = tensor(&batch.fronts, &[n, 2]);
    let lengths = tensor(&lengths, &[n, 1]);
    let along = (evidence * direction).sum_dim_intlist(1, true, Kind::Float);
    let ratio = along * 2.0 / (&lengths + 1e-6);
    (ratio.neg().softplus() * lengths).sum(Kind::Float) / f64::from(certain)
}

/// Surprise about the errors of the maxima, if they are distributed exponentially with the expected error as mean.
fn of_error(batch: &Batch, logarithms: &Tensor, maps: &[f32]) -> Tensor {
    let [off, is_known] = batch.off(maps);
    let n_known = is_known.iter().sum::<f32>().max(1.0);
    let dims = [batch.n as i64, N_JOINTS as i64];
    let logarithms = logarithms.clamp(-8.0, 2.0);
    let surprise = tensor(&off, &dims) * logarithms.neg().exp() + logarithms;
    (surprise * tensor(&is_known, &dims)).sum(Kind::Float) / f64::from(n_known)
}

fn tensor(values: &[f32], dims: &[i64]) -> Tensor {
    Tensor::from_slice(values).reshape(dims)
}

fn tensors(parameters: &[Parameter], learned: &dyn Fn(&Parameter) -> bool) -> Vec<Tensor> {
    let tensor = |it: &Parameter| Tensor::from_slice(&it.values).set_requires_grad(learned(it));
    parameters.iter().map(tensor).collect()
}

/// The values in the order of the dimensions.
fn numbers(of: &Tensor) -> Vec<f32> {
    let flat = of.to_kind(Kind::Float).contiguous().flatten(0, -1);
    Vec::try_from(flat).unwrap_or_default()
}

/// The same numbers, with the channels of a cell side by side.
fn channels_last(of: &Tensor) -> Tensor {
    of.permute([0, 2, 3, 1]).contiguous().permute([0, 3, 1, 2])
}

/// Runs a network on a batch.
struct Forward<'a> {
    /// Names and sizes.
    parameters: &'a [Parameter],
    /// The same values as flat tensors.
    tensors: &'a [Tensor],
    picture: Tensor,
    /// Type of the numbers in maps.
    numbers: Kind,
    /// Number of the next parameter.
    next: usize,
}

impl<'a> Forward<'a> {
    fn new(
        network: Network<'a>,
        (n, [width, height], pictures): (usize, [usize; 2], &[f32]),
        tensors: &'a [Tensor],
    ) -> Self {
        let dims = [n, 3, height, width].map(|it| it as i64);
        Self {
            parameters: network.parameters,
            tensors,
            picture: channels_last(&tensor(pictures, &dims)),
            numbers: match network.precision {
                Precision::F32 => Kind::Float,
                Precision::Bf16 => Kind::BFloat16,
            },
            next: 0,
        }
    }

    fn parameter(&mut self, name: &str) -> &'a Tensor {
        let at = self.next;
        self.next += 1;
        assert_eq!(
            self.parameters[at].name, name,
            "parameters in the order of the layers"
        );
        &self.tensors[at]
    }

    fn dims<const D: usize>(&self) -> [i64; D] {
        core::array::from_fn(|it| self.parameters[self.next].dims[it] as i64)
    }

    /// The standardised weights of a convolution: [`standardised`](crate::parameters::standardised).
    fn weight(&mut self, name: &str) -> Tensor {
        let dims: [i64; 4] = self.dims();
        let weight = self.parameter(&format!("{name}.weight"));
        let gain = self.parameter(&format!("{name}.gain"));
        let rows = weight.reshape([dims[0], -1]);
        let rows = &rows - rows.mean_dim(1, true, Kind::Float);
        let squared = rows.square().sum_dim_intlist(1, true, Kind::Float);
        let factor =
            gain.reshape([-1, 1]) * f64::from(GAIN_OF_RELU) / (squared + f64::from(EPSILON)).sqrt();
        let weight = (rows * factor).reshape(dims).to_kind(self.numbers);
        channels_last(&weight)
    }
}

/// The cells of every channel in a row, single precision.
fn rows(of: &Tensor) -> Tensor {
    of.to_kind(Kind::Float).flatten(2, 3)
}

impl Ops for Forward<'_> {
    type Value = Rc<Tensor>;

    fn picture(&mut self) -> Rc<Tensor> {
        Rc::new(self.picture.to_kind(self.numbers))
    }

    fn conv(&mut self, of: &Rc<Tensor>, name: &str, conv: Conv) -> Rc<Tensor> {
        let weight = self.weight(name);
        let bias = self
            .parameter(&format!("{name}.bias"))
            .to_kind(self.numbers);
        let [stride, half] = [conv.stride, conv.kernel / 2].map(|it| it as i64);
        Rc::new(of.conv2d(&weight, Some(&bias), stride, half, 1, 1))
    }

    fn relu(&mut self, of: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(of.relu())
    }

    fn add(&mut self, a: &Rc<Tensor>, b: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(&**a + &**b)
    }

    fn doubled(&mut self, of: &Rc<Tensor>) -> Rc<Tensor> {
        let size = of.size();
        Rc::new(of.upsample_nearest2d([2 * size[2], 2 * size[3]], None, None))
    }

    fn mean(&mut self, of: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(rows(of).mean_dim(2, false, Kind::Float))
    }

    fn fixed(&mut self, of: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(of.detach())
    }

    fn look(&mut self, of: &Rc<Tensor>, maps: &Rc<Tensor>, sharpness: f32) -> Rc<Tensor> {
        let weights = (rows(maps) * f64::from(sharpness)).softmax(2, Kind::Float);
        let looked = weights.matmul(&rows(of).transpose(1, 2));
        Rc::new(looked.flatten(1, 2))
    }

    fn place(&mut self, maps: &Rc<Tensor>, sharpness: f32) -> Rc<Tensor> {
        let size = maps.size();
        let grid = grid(size[3] as usize, size[2] as usize);
        let weights = (rows(maps) * f64::from(sharpness)).softmax(2, Kind::Float);
        Rc::new(weights.matmul(&tensor(&grid, &[-1, 3])).flatten(1, 2))
    }

    fn highest(&mut self, of: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(rows(of).amax(2, false))
    }

    fn join(&mut self, of: &[&Rc<Tensor>]) -> Rc<Tensor> {
        let all: Vec<&Tensor> = of.iter().map(|it| it.as_ref().as_ref()).collect();
        Rc::new(Tensor::cat(&all, 1))
    }

    fn dense(&mut self, of: &Rc<Tensor>, name: &str, _: usize) -> Rc<Tensor> {
        let dims: [i64; 2] = self.dims();
        let weight = self.parameter(&format!("{name}.weight")).reshape(dims);
        let bias = self.parameter(&format!("{name}.bias"));
        Rc::new(of.matmul(&weight.transpose(0, 1)) + bias)
    }
}
