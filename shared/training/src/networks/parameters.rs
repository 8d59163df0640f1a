//! The parameters of a network, their initialisation, and the standardised weights of its convolutions.

use fastrand::Rng;
use serde::{Deserialize, Serialize};

use crate::networks::ops::{Conv, Dims, Network, Ops, Places, Scaling, convolved, joined};

/// Gain that keeps the variance of the positive part of a normal variable: `sqrt(2 / (1 - 1 / pi))`.
pub(crate) const GAIN_OF_RELU: f32 = 1.712_858_6;
/// Value added to the squared length of a channel of weights before the root.
pub(crate) const EPSILON_OF_LENGTH: f32 = 1e-8;
/// Value added to the variance over a batch before the root.
pub(crate) const EPSILON_OF_BATCH: f32 = 1e-5;

/// The role of a list of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Trained with weight decay.
    Weight,
    /// Trained without weight decay.
    Bias,
    /// A statistic of the data, which is not trained.
    Fixed,
}

/// One list of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name of the layer and role of the values, for example `stem1.weight`.
    pub name: String,
    /// Dimensions, row-major.
    pub dims: Vec<usize>,
    /// Role of the parameters in the network.
    pub role: Role,
    /// Values of the parameters.
    pub values: Vec<f32>,
}

/// The initial parameters of a network, in the order in which the network uses them.
///
/// Weights are drawn from a normal distribution with the standard deviation `sqrt(2 / n_inputs)` (He et al. 2015). Slopes are 1/4, gains
/// are set by the network, biases and means are 0, factors and variances are 1.
pub fn initial(network: &impl Network, seed: u64) -> Vec<Parameter> {
    let mut plan = Plan {
        inputs: network.inputs(),
        rng: Rng::with_seed(seed),
        all: Vec::new(),
    };
    network.run(&mut plan);
    plan.all
}

struct Plan {
    inputs: Vec<(&'static str, Dims)>,
    rng: Rng,
    all: Vec<Parameter>,
}

impl Plan {
    fn weight(&mut self, layer: &str, dims: Dims) {
        let n_inputs: usize = dims[1..].iter().product();
        let deviation = (2.0 / n_inputs as f32).sqrt();
        let n: usize = dims.iter().product();
        let values = (0..n).map(|_| normal(&mut self.rng) * deviation).collect();
        let name = format!("{layer}.weight");
        self.all.push(Parameter {
            name,
            dims,
            role: Role::Weight,
            values,
        });
    }

    fn constant(&mut self, name: String, n: usize, (role, value): (Role, f32)) {
        let values = vec![value; n];
        self.all.push(Parameter {
            name,
            dims: vec![n],
            role,
            values,
        });
    }
}

/// A random number of the standard normal distribution (Box and Muller).
pub(crate) fn normal(rng: &mut Rng) -> f32 {
    let radius = (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
    (radius * (core::f64::consts::TAU * rng.f64()).cos()) as f32
}

/// The standardised weights of a convolution. The weights of every channel have mean 0 and a length that preserves the variance through a
/// `ReLU`, and are multiplied by the gain of the channel.
///
/// * `weights`: `gains.len()` channels, one after the other.
pub(crate) fn standardised(weights: &[f32], gains: &[f32]) -> Vec<f32> {
    let n_inputs = weights.len() / gains.len();
    let mut all = Vec::with_capacity(weights.len());
    for (channel, gain) in weights.chunks_exact(n_inputs).zip(gains) {
        let mean = channel.iter().sum::<f32>() / n_inputs as f32;
        let squared: f32 = channel.iter().map(|value| (value - mean).powi(2)).sum();
        let factor = gain * GAIN_OF_RELU / (squared + EPSILON_OF_LENGTH).sqrt();
        all.extend(channel.iter().map(|value| (value - mean) * factor));
    }
    all
}

impl Ops for Plan {
    type Value = Dims;

    fn input(&mut self, name: &'static str) -> Dims {
        let found = self.inputs.iter().find(|input| input.0 == name);
        found.map(|input| input.1.clone()).unwrap_or_default()
    }

    fn centred(&mut self, list: &Dims, name: &str) -> Dims {
        for (what, value) in [("mean", 0.0), ("factor", 1.0)] {
            self.constant(format!("{name}.{what}"), list[0], (Role::Fixed, value));
        }
        list.clone()
    }

    fn conv(&mut self, map: &Dims, name: &str, conv: Conv) -> Dims {
        let inputs = if conv.by_channel { 1 } else { map[0] };
        let n = conv.channels;
        self.weight(name, vec![n, inputs, conv.kernel, conv.kernel]);
        let bias = ("bias", Role::Bias, 0.0);
        let all: &[(&str, Role, f32)] = match conv.scaling {
            Scaling::Plain => &[bias],
            Scaling::Standardised { gain } => &[("gain", Role::Bias, gain), bias],
            Scaling::Batch => &[
                ("scale", Role::Bias, 1.0),
                ("shift", Role::Bias, 0.0),
                ("mean", Role::Fixed, 0.0),
                ("variance", Role::Fixed, 1.0),
            ],
        };
        for &(what, role, value) in all {
            self.constant(format!("{name}.{what}"), n, (role, value));
        }
        convolved(map, conv)
    }

    fn relu(&mut self, value: &Dims) -> Dims {
        value.clone()
    }

    fn add(&mut self, a: &Dims, b: &Dims) -> Dims {
        debug_assert_eq!(a, b, "values of one shape");
        a.clone()
    }

    fn doubled(&mut self, map: &Dims) -> Dims {
        vec![map[0], 2 * map[1], 2 * map[2]]
    }

    fn pool(&mut self, map: &Dims) -> Dims {
        vec![map[0], map[1] / 2, map[2] / 2]
    }

    fn mean(&mut self, map: &Dims) -> Dims {
        vec![map[0]]
    }

    fn highest(&mut self, map: &Dims) -> Dims {
        vec![map[0]]
    }

    fn flat(&mut self, map: &Dims) -> Dims {
        vec![map.iter().product()]
    }

    fn fixed(&mut self, value: &Dims) -> Dims {
        value.clone()
    }

    fn softmax(&mut self, maps: &Dims, _: f32) -> Dims {
        maps.clone()
    }

    fn around(&mut self, _: &Dims, like: &Dims, places: &Places) -> Dims {
        vec![places.x.len(), like[1], like[2]]
    }

    fn look(&mut self, map: &Dims, weights: &Dims) -> Dims {
        vec![map[0] * weights[0]]
    }

    fn place(&mut self, weights: &Dims) -> Dims {
        vec![3 * weights[0]]
    }

    fn join(&mut self, lists: &[&Dims]) -> Dims {
        let dims: Vec<&[usize]> = lists.iter().map(|list| list.as_slice()).collect();
        joined(&dims)
    }

    fn dense(&mut self, list: &Dims, name: &str, values: usize) -> Dims {
        self.weight(name, vec![values, list[0]]);
        self.constant(format!("{name}.bias"), values, (Role::Bias, 0.0));
        vec![values]
    }

    fn prelu(&mut self, list: &Dims, name: &str) -> Dims {
        self.constant(name.to_owned(), list[0], (Role::Bias, 0.25));
        list.clone()
    }

    fn dropout(&mut self, list: &Dims, _: f32) -> Dims {
        list.clone()
    }
}
