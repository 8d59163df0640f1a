//! The parameters of a network, and their initialisation.

use fastrand::Rng;
use serde::{Deserialize, Serialize};

use crate::network::{self, Conv, Ops, Places, Shape};

/// The role of a list of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Trained with weight decay.
    Weight,
    /// Trained without weight decay.
    Bias,
    /// A statistic of the data: not trained.
    Fixed,
}

/// One list of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Layer and role, for example `first.weight`.
    pub name: String,
    /// Its dimensions, row-major.
    pub dims: Vec<usize>,
    /// What it is for.
    pub role: Role,
    /// The numbers.
    pub values: Vec<f32>,
}

/// Sizes and statistics of the networks' inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Inputs {
    /// Height and width of the tile, pixels.
    pub tile: [usize; 2],
    /// Mean of every column of the evidence.
    pub evidence_mean: Vec<f32>,
    /// Its deviation, more than 0.
    pub evidence_deviation: Vec<f32>,
}

/// The parameters of a network at the beginning, in the order in which it takes them.
///
/// Weights are drawn from a normal distribution with the deviation `sqrt(2 / n_inputs)` (He et al. 2015), those of
/// the last layer are 0, slopes are 1/4, and biases 0 but for the last ones, which are `outputs`.
///
/// * `outputs`: the outputs of the untrained network for every part.
pub fn initial(shape: &Shape, inputs: &Inputs, outputs: &[f32], seed: u64) -> Vec<Parameter> {
    let mut plan = Plan {
        inputs,
        rng: Rng::with_seed(seed),
        all: Vec::new(),
    };
    network::run(&mut plan, shape);
    let n = plan.all.len();
    if let [.., weight, bias] = &mut plan.all[..n] {
        weight.values.fill(0.0);
        bias.values.copy_from_slice(outputs);
    }
    plan.all
}

/// Sizes of a value, without that of the batch: `[channels, rows, cols]` or `[values]`.
pub(crate) type Dims = Vec<usize>;

struct Plan<'a> {
    inputs: &'a Inputs,
    rng: Rng,
    all: Vec<Parameter>,
}

impl Plan<'_> {
    fn add(&mut self, name: String, dims: Dims, role: Role, values: Vec<f32>) {
        self.all.push(Parameter {
            name,
            dims,
            role,
            values,
        });
    }

    fn weight(&mut self, layer: &str, dims: Dims) {
        let n_inputs: usize = dims[1..].iter().product();
        let deviation = (2.0 / n_inputs as f32).sqrt();
        let n: usize = dims.iter().product();
        let values = (0..n).map(|_| normal(&mut self.rng) * deviation).collect();
        self.add(format!("{layer}.weight"), dims, Role::Weight, values);
    }

    fn constant(&mut self, name: String, n: usize, role: Role, value: f32) {
        self.add(name, vec![n], role, vec![value; n]);
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

impl Ops for Plan<'_> {
    type Value = Dims;

    fn tile(&mut self) -> Dims {
        vec![3, self.inputs.tile[0], self.inputs.tile[1]]
    }

    fn evidence(&mut self) -> Dims {
        let (mean, deviation) = (&self.inputs.evidence_mean, &self.inputs.evidence_deviation);
        let n = mean.len();
        let factor = deviation.iter().map(|it| 1.0 / it).collect();
        self.add(
            "evidence.mean".to_owned(),
            vec![n],
            Role::Fixed,
            mean.clone(),
        );
        self.add("evidence.factor".to_owned(), vec![n], Role::Fixed, factor);
        vec![n]
    }

    fn conv(&mut self, of: &Dims, name: &str, conv: Conv) -> Dims {
        let inputs = if conv.by_channel { 1 } else { of[0] };
        let n = conv.channels;
        self.weight(name, vec![n, inputs, conv.kernel, conv.kernel]);
        if conv.normalised {
            self.constant(format!("{name}.scale"), n, Role::Bias, 1.0);
            self.constant(format!("{name}.shift"), n, Role::Bias, 0.0);
            self.constant(format!("{name}.mean"), n, Role::Fixed, 0.0);
            self.constant(format!("{name}.variance"), n, Role::Fixed, 1.0);
        } else {
            self.constant(format!("{name}.bias"), n, Role::Bias, 0.0);
        }
        convolved(of, conv)
    }

    fn pool(&mut self, of: &Dims) -> Dims {
        vec![of[0], of[1] / 2, of[2] / 2]
    }

    fn mean(&mut self, of: &Dims) -> Dims {
        vec![of[0]]
    }

    fn flat(&mut self, of: &Dims) -> Dims {
        vec![of.iter().product()]
    }

    fn look(&mut self, of: &Dims, places: &Places, _: f32) -> Dims {
        vec![of[0] * places.x.len()]
    }

    fn join(&mut self, of: &[&Dims]) -> Dims {
        vec![of.iter().map(|it| it[0]).sum()]
    }

    fn dense(&mut self, of: &Dims, name: &str, values: usize) -> Dims {
        self.weight(name, vec![values, of[0]]);
        self.constant(format!("{name}.bias"), values, Role::Bias, 0.0);
        vec![values]
    }

    fn prelu(&mut self, of: &Dims, name: &str) -> Dims {
        self.constant(name.to_owned(), of[0], Role::Bias, 0.25);
        of.clone()
    }

    fn dropout(&mut self, of: &Dims, _: f32) -> Dims {
        of.clone()
    }
}
