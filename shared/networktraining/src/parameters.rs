//! The parameters of the network, their initialisation, and the standardised weights that it convolves with.

use fastrand::Rng;
use serde::{Deserialize, Serialize};

use crate::network::{self, Conv, Ops, Shape};

/// The log-odds of an untrained map.
const MAP_BIAS: f32 = -4.0;
/// The logarithm of the expected error before training: a tenth of the input's height.
const ERROR_BIAS: f32 = -2.3;
/// What keeps the variance of a positive part of a normal variable: `sqrt(2 / (1 - 1 / pi))`.
pub(crate) const GAIN_OF_RELU: f32 = 1.712_858_6;
/// Added to a variance before the root is taken.
pub(crate) const EPSILON: f32 = 1e-8;

/// The role of a list of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Trained with weight decay.
    Weight,
    /// Trained without weight decay.
    Bias,
}

/// One list of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Layer and role, for example `stem1.weight`.
    pub name: String,
    /// Its dimensions, row-major.
    pub dims: Vec<usize>,
    /// What it is for.
    pub role: Role,
    /// The numbers.
    pub values: Vec<f32>,
}

/// The parameters at the beginning, in the order in which the network takes them.
///
/// Weights are drawn from a normal distribution with the deviation `sqrt(2 / n_inputs)` (He et al. 2015); those of the last dense
/// layers are 0, and biases as well but for the last ones.
pub fn initial(shape: &Shape, seed: u64) -> Vec<Parameter> {
    let mut plan = Plan {
        shape,
        rng: Rng::with_seed(seed),
        all: Vec::new(),
    };
    network::run(&mut plan, shape);
    for it in &mut plan.all {
        match it.name.as_str() {
            "maps.bias" => it.values.fill(MAP_BIAS),
            "error2.bias" => it.values.fill(ERROR_BIAS),
            "error2.weight" | "front2.weight" => it.values.fill(0.0),
            _ => (),
        }
    }
    plan.all
}

/// Sizes of a value, without that of the batch: `[channels, rows, columns]` or `[values]`.
pub(crate) type Dims = Vec<usize>;

struct Plan<'a> {
    shape: &'a Shape,
    rng: Rng,
    all: Vec<Parameter>,
}

impl Plan<'_> {
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

    fn constant(&mut self, name: String, n: usize, value: f32) {
        let values = vec![value; n];
        self.all.push(Parameter {
            name,
            dims: vec![n],
            role: Role::Bias,
            values,
        });
    }
}

/// A number of the standard normal distribution (Box and Muller).
pub(crate) fn normal(rng: &mut Rng) -> f32 {
    let radius = (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
    (radius * (core::f64::consts::TAU * rng.f64()).cos()) as f32
}

/// Dimensions of the output of a convolution.
pub(crate) fn convolved(of: &[usize], conv: Conv) -> Dims {
    let side = |it: usize| (it - 1) / conv.stride + 1;
    vec![conv.channels, side(of[1]), side(of[2])]
}

/// The weights of a convolution as they are used: every channel with mean 0, of the length that keeps the variance of positive parts,
/// times its gain.
///
/// * `weights`: `gains.len()` channels, one after the other.
pub(crate) fn standardised(weights: &[f32], gains: &[f32]) -> Vec<f32> {
    let n_inputs = weights.len() / gains.len();
    let mut all = Vec::with_capacity(weights.len());
    for (channel, gain) in weights.chunks_exact(n_inputs).zip(gains) {
        let n = n_inputs as f32;
        let mean = channel.iter().sum::<f32>() / n;
        let variance = channel.iter().map(|it| (it - mean).powi(2)).sum::<f32>() / n;
        let factor = gain * GAIN_OF_RELU / (variance * n + EPSILON).sqrt();
        all.extend(channel.iter().map(|it| (it - mean) * factor));
    }
    all
}

impl Ops for Plan<'_> {
    type Value = Dims;

    fn picture(&mut self) -> Dims {
        vec![3, self.shape.height, self.shape.width]
    }

    fn conv(&mut self, of: &Dims, name: &str, conv: Conv) -> Dims {
        let n = conv.channels;
        self.weight(name, vec![n, of[0], conv.kernel, conv.kernel]);
        self.constant(format!("{name}.gain"), n, conv.gain);
        self.constant(format!("{name}.bias"), n, 0.0);
        convolved(of, conv)
    }

    fn relu(&mut self, of: &Dims) -> Dims {
        of.clone()
    }

    fn add(&mut self, a: &Dims, b: &Dims) -> Dims {
        debug_assert_eq!(a, b, "values of one shape");
        a.clone()
    }

    fn doubled(&mut self, of: &Dims) -> Dims {
        vec![of[0], 2 * of[1], 2 * of[2]]
    }

    fn mean(&mut self, of: &Dims) -> Dims {
        vec![of[0]]
    }

    fn fixed(&mut self, of: &Dims) -> Dims {
        of.clone()
    }

    fn look(&mut self, of: &Dims, maps: &Dims, _: f32) -> Dims {
        vec![of[0] * maps[0]]
    }

    fn place(&mut self, maps: &Dims, _: f32) -> Dims {
        vec![3 * maps[0]]
    }

    fn highest(&mut self, of: &Dims) -> Dims {
        vec![of[0]]
    }

    fn join(&mut self, of: &[&Dims]) -> Dims {
        vec![of.iter().map(|it| it[0]).sum()]
    }

    fn dense(&mut self, of: &Dims, name: &str, values: usize) -> Dims {
        self.weight(name, vec![values, of[0]]);
        self.constant(format!("{name}.bias"), values, 0.0);
        vec![values]
    }
}
