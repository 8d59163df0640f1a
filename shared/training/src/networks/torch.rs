//! Runs and trains networks on `LibTorch`, which records the forward pass itself.
//!
//! Maps are stored here with the channels of a cell next to each other, the layout that the convolutions need.

use std::rc::Rc;

use fastrand::Rng;
use tch::{Kind, Tensor};

use crate::networks::lesson::{Lesson, Running, Shown, Statistics};
use crate::networks::ops::{Along, Conv, Dims, Network, Ops, Places, Scaling, grid};
use crate::networks::parameters::{EPSILON_OF_BATCH, EPSILON_OF_LENGTH, GAIN_OF_RELU, Parameter};
use crate::networks::settings::Precision;

/// Returns the outputs of a network.
pub(crate) fn find(
    network: &impl Network,
    parameters: &[Parameter],
    (shown, precision): (&Shown, Precision),
) -> Vec<Vec<f32>> {
    tch::no_grad(|| {
        let tensors = tensors(parameters, &|_| false);
        let mut forward = Forward::new(network, (parameters, &tensors), (shown, precision));
        let outputs = network.run(&mut forward);
        outputs.iter().map(|output| numbers(output)).collect()
    })
}

/// Returns the gradients of a cost.
///
/// * `cost`: computes the gradients of the cost from the outputs.
pub(crate) fn learn(
    network: &impl Network,
    running: Running<'_>,
    (shown, precision): (&Shown, Precision),
    cost: &mut dyn FnMut(&[Vec<f32>]) -> Vec<Vec<f32>>,
) -> Lesson {
    let tensors = tensors(running.parameters, &|at| running.learned[at]);
    let mut forward = Forward::new(network, (running.parameters, &tensors), (shown, precision));
    forward.dice = Some(running.dice);
    let outputs = network.run(&mut forward);
    let values: Vec<Vec<f32>> = outputs.iter().map(|output| numbers(output)).collect();
    // The gradients of this value with respect to the outputs are equal to the gradients of the cost.
    let slope = outputs
        .iter()
        .zip(cost(&values))
        .filter(|(output, _)| output.requires_grad())
        .map(|(output, gradient)| {
            let gradient = tensor(&gradient, &output.size());
            (output.to_kind(Kind::Float) * gradient).sum(Kind::Float)
        })
        .reduce(|sum, part| sum + part);
    if let Some(slope) = slope {
        slope.backward();
    }
    let gradients = tensors.iter().map(|tensor| {
        let gradient = tensor.grad();
        gradient.defined().then(|| numbers(&gradient))
    });
    Lesson {
        gradients: gradients.collect(),
        statistics: forward.statistics,
    }
}

fn tensor(values: &[f32], dims: &[i64]) -> Tensor {
    Tensor::from_slice(values).reshape(dims)
}

fn tensors(parameters: &[Parameter], learned: &dyn Fn(usize) -> bool) -> Vec<Tensor> {
    let tensor = |(at, parameter): (usize, &Parameter)| {
        Tensor::from_slice(&parameter.values).set_requires_grad(learned(at))
    };
    parameters.iter().enumerate().map(tensor).collect()
}

/// The values of a tensor, in the order of its dimensions.
fn numbers(value: &Tensor) -> Vec<f32> {
    let flat = value.detach().to_kind(Kind::Float).contiguous().flatten(0, -1);
    Vec::try_from(flat).unwrap_or_default()
}

/// Converts a map to the layout with the channels of a cell next to each other.
fn channels_last(map: &Tensor) -> Tensor {
    map.permute([0, 2, 3, 1]).contiguous().permute([0, 3, 1, 2])
}

/// Runs a network on a batch.
struct Forward<'a> {
    n: usize,
    inputs: Vec<(&'static str, Dims, &'a [f32])>,
    /// Names and dimensions of the parameters.
    parameters: &'a [Parameter],
    /// The parameters as flat tensors.
    tensors: &'a [Tensor],
    /// Number type of the maps.
    numbers: Kind,
    /// Index of the next parameter.
    next: usize,
    /// Random generator; `None` if the network is not being trained.
    dice: Option<Rng>,
    statistics: Vec<Statistics>,
}

impl<'a> Forward<'a> {
    fn new(
        network: &impl Network,
        (parameters, tensors): (&'a [Parameter], &'a [Tensor]),
        (shown, precision): (&'a Shown, Precision),
    ) -> Self {
        let inputs = network.inputs().into_iter().zip(&shown.inputs);
        Self {
            n: shown.n,
            inputs: inputs.map(|((name, dims), values)| (name, dims, values.as_slice())).collect(),
            parameters,
            tensors,
            numbers: match precision {
                Precision::F32 => Kind::Float,
                Precision::Bf16 => Kind::BFloat16,
            },
            next: 0,
            dice: None,
            statistics: Vec::new(),
        }
    }

    fn parameter(&mut self, name: &str) -> &'a Tensor {
        let at = self.next;
        self.next += 1;
        assert_eq!(
            self.parameters[at].name, name,
            "parameters must be in the order of the layers"
        );
        &self.tensors[at]
    }

    fn dims<const D: usize>(&self) -> [i64; D] {
        core::array::from_fn(|at| self.parameters[self.next].dims[at] as i64)
    }

    /// The weights of a convolution, [standardised](crate::networks::parameters::standardised) if its scaling requires this.
    fn weight(&mut self, name: &str, scaling: Scaling) -> Tensor {
        let dims: [i64; 4] = self.dims();
        let weight = self.parameter(&format!("{name}.weight"));
        let rows = weight.reshape([dims[0], -1]);
        let rows = if matches!(scaling, Scaling::Standardised { .. }) {
            let gain = self.parameter(&format!("{name}.gain"));
            let rows = &rows - rows.mean_dim(1, true, Kind::Float);
            let squared = rows.square().sum_dim_intlist(1, true, Kind::Float);
            let length = (squared + f64::from(EPSILON_OF_LENGTH)).sqrt();
            let factor = gain.reshape([-1, 1]) * f64::from(GAIN_OF_RELU) / length;
            rows * factor
        } else {
            rows
        };
        channels_last(&rows.reshape(dims).to_kind(self.numbers))
    }

    /// Normalises every channel with the statistics of the batch, or with running statistics if the network is not being trained.
    fn normalised(&mut self, map: &Tensor, name: &str) -> Tensor {
        let [scale, shift] =
            ["scale", "shift"].map(|what| self.parameter(&format!("{name}.{what}")));
        let at = self.next;
        let [mean, variance] =
            ["mean", "variance"].map(|what| self.parameter(&format!("{name}.{what}")));
        let all = [0, 2, 3];
        let (mean, variance) = if self.dice.is_some() {
            let mean = map.mean_dim(&all[..], true, Kind::Float);
            let off = map - &mean;
            let variance = off.square().mean_dim(&all[..], false, Kind::Float);
            let mean = mean.reshape([-1]);
            self.statistics.push(Statistics {
                at,
                mean: numbers(&mean),
                variance: numbers(&variance),
            });
            (mean, variance)
        } else {
            (mean.shallow_clone(), variance.shallow_clone())
        };
        let factor = scale / (variance + f64::from(EPSILON_OF_BATCH)).sqrt();
        let shift = shift - mean * &factor;
        map * factor.reshape([1, -1, 1, 1]) + shift.reshape([1, -1, 1, 1])
    }
}

/// Reshapes a map so that the cells of every channel form a row, in single precision.
fn rows(map: &Tensor) -> Tensor {
    map.to_kind(Kind::Float).flatten(2, 3)
}

impl Ops for Forward<'_> {
    type Value = Rc<Tensor>;

    fn input(&mut self, name: &'static str) -> Rc<Tensor> {
        let found = self.inputs.iter().find(|input| input.0 == name);
        let (dims, values) = found.map_or((vec![0], &[][..]), |(_, dims, values)| {
            (dims.clone(), *values)
        });
        let dims: Vec<i64> = core::iter::once(self.n).chain(dims).map(|dim| dim as i64).collect();
        let values = tensor(values, &dims);
        Rc::new(if dims.len() == 4 {
            channels_last(&values).to_kind(self.numbers)
        } else {
            values
        })
    }

    fn centred(&mut self, list: &Rc<Tensor>, name: &str) -> Rc<Tensor> {
        let [mean, factor] =
            ["mean", "factor"].map(|what| self.parameter(&format!("{name}.{what}")));
        Rc::new((&**list - mean) * factor)
    }

    fn conv(&mut self, map: &Rc<Tensor>, name: &str, conv: Conv) -> Rc<Tensor> {
        let weight = self.weight(name, conv.scaling);
        let bias = (conv.scaling != Scaling::Batch)
            .then(|| self.parameter(&format!("{name}.bias")).to_kind(self.numbers));
        let [stride, half] = [conv.stride, conv.kernel / 2].map(|size| size as i64);
        let groups = if conv.by_channel { conv.channels } else { 1 };
        let map = map.conv2d(&weight, bias, stride, half, 1, groups as i64);
        Rc::new(if conv.scaling == Scaling::Batch {
            self.normalised(&map, name)
        } else {
            map
        })
    }

    fn relu(&mut self, value: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(value.relu())
    }

    fn add(&mut self, a: &Rc<Tensor>, b: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(&**a + &**b)
    }

    fn doubled(&mut self, map: &Rc<Tensor>) -> Rc<Tensor> {
        let size = map.size();
        Rc::new(map.upsample_nearest2d([2 * size[2], 2 * size[3]], None, None))
    }

    fn pool(&mut self, map: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(map.max_pool2d([2, 2], [2, 2], [0, 0], [1, 1], false))
    }

    fn mean(&mut self, map: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(rows(map).mean_dim(2, false, Kind::Float))
    }

    fn highest(&mut self, map: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(rows(map).max_dim(2, false).0)
    }

    fn flat(&mut self, map: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(map.to_kind(Kind::Float).flatten(1, -1))
    }

    fn fixed(&mut self, value: &Rc<Tensor>) -> Rc<Tensor> {
        Rc::new(value.detach())
    }

    fn softmax(&mut self, maps: &Rc<Tensor>, sharpness: f32) -> Rc<Tensor> {
        let weights = (rows(maps) * f64::from(sharpness)).softmax(2, Kind::Float);
        Rc::new(weights.reshape(maps.size()))
    }

    fn around(&mut self, list: &Rc<Tensor>, like: &Rc<Tensor>, places: &Places) -> Rc<Tensor> {
        let size = like.size();
        let (down, across) = (size[2] as usize, size[3] as usize);
        let along = |columns: &[usize], along: &Along| -> Tensor {
            let columns: Vec<i64> = columns.iter().map(|column| *column as i64).collect();
            let places = list.index_select(1, &Tensor::from_slice(&columns));
            let off = places.unsqueeze(2) - Tensor::from_slice(&along.centres);
            (off.square() * f64::from(along.factor)).exp()
        };
        let x = along(
            &places.x,
            &Along::new(across, places.width, places.deviation),
        );
        let y = along(&places.y, &Along::new(down, 1.0, places.deviation));
        Rc::new((y.unsqueeze(3) * x.unsqueeze(2)).detach())
    }

    fn look(&mut self, map: &Rc<Tensor>, weights: &Rc<Tensor>) -> Rc<Tensor> {
        let looked = rows(weights).matmul(&rows(map).transpose(1, 2));
        Rc::new(looked.flatten(1, 2))
    }

    fn place(&mut self, weights: &Rc<Tensor>) -> Rc<Tensor> {
        let size = weights.size();
        let grid = grid(size[3] as usize, size[2] as usize);
        let places = rows(weights).matmul(&tensor(&grid, &[-1, 3]));
        Rc::new(places.flatten(1, 2))
    }

    fn join(&mut self, lists: &[&Rc<Tensor>]) -> Rc<Tensor> {
        let all: Vec<&Tensor> = lists.iter().map(|list| list.as_ref().as_ref()).collect();
        Rc::new(Tensor::cat(&all, 1))
    }

    fn dense(&mut self, list: &Rc<Tensor>, name: &str, _: usize) -> Rc<Tensor> {
        let dims: [i64; 2] = self.dims();
        let weight = self.parameter(&format!("{name}.weight")).reshape(dims);
        let bias = self.parameter(&format!("{name}.bias"));
        Rc::new(list.matmul(&weight.transpose(0, 1)) + bias)
    }

    fn prelu(&mut self, list: &Rc<Tensor>, name: &str) -> Rc<Tensor> {
        let slope = self.parameter(name);
        Rc::new(list.prelu(slope))
    }

    fn dropout(&mut self, list: &Rc<Tensor>, share: f32) -> Rc<Tensor> {
        let Some(dice) = &mut self.dice else {
            return Rc::clone(list);
        };
        let size = list.size();
        let kept = 1.0 / (1.0 - share);
        let factors: Vec<f32> = (0..size.iter().product())
            .map(|_: i64| if dice.f32() < share { 0.0 } else { kept })
            .collect();
        Rc::new(&**list * tensor(&factors, &size))
    }
}
