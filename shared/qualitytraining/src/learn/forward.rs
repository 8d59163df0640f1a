//! The forward pass of a network in burn, recorded for the backward pass.

use burn_tensor::ops::{ConvOptions, MaxPoolOptions};
use burn_tensor::{Device, Tensor, TensorData, activation, module};
use fastrand::Rng;

use crate::network::{Conv, Ops, Places};
use crate::onnx::{EPSILON, cells_along};
use crate::parameters::Parameter;

/// A map or a list of every sample.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Map(Tensor<4>),
    List(Tensor<2>),
}

impl Value {
    #[expect(
        clippy::panic,
        reason = "a network that mixes maps and lists is a mistake in its source"
    )]
    fn map(&self) -> Tensor<4> {
        match self {
            Self::Map(it) => it.clone(),
            Self::List(_) => panic!("a map is needed"),
        }
    }

    #[expect(
        clippy::panic,
        reason = "a network that mixes maps and lists is a mistake in its source"
    )]
    pub(super) fn list(&self) -> Tensor<2> {
        match self {
            Self::List(it) => it.clone(),
            Self::Map(_) => panic!("a list is needed"),
        }
    }
}

/// Mean and variance of every channel at a batch normalisation, and the parameters they belong to.
#[derive(Debug)]
pub(super) struct BatchStatistics {
    /// The parameter that holds the running mean; the variance follows it.
    pub(super) at: usize,
    pub(super) mean: Tensor<1>,
    pub(super) variance: Tensor<1>,
}

/// Runs a network on a batch.
pub(super) struct Forward<'a> {
    pub(super) device: &'a Device,
    /// Names and sizes.
    pub(super) parameters: &'a [Parameter],
    /// The same values as flat tensors.
    pub(super) tensors: &'a [Tensor<1>],
    pub(super) tile: Option<Tensor<4>>,
    pub(super) evidence: Option<Tensor<2>>,
    /// Width of the tile in tile heights.
    pub(super) width: f32,
    /// Random generator for dropout; `None` outside training.
    pub(super) dice: Option<&'a mut Rng>,
    /// Number of the next parameter.
    pub(super) next: usize,
    pub(super) seen: Vec<BatchStatistics>,
}

impl Forward<'_> {
    fn parameter(&mut self, name: &str) -> Tensor<1> {
        let at = self.next;
        self.next += 1;
        assert_eq!(
            self.parameters[at].name, name,
            "parameters in the order of the layers"
        );
        self.tensors[at].clone()
    }

    fn sizes(&self, at: usize) -> &[usize] {
        &self.parameters[at].dims
    }

    fn normalised(&mut self, of: Tensor<4>, name: &str) -> Tensor<4> {
        let [n, channels, rows, cols] = of.dims();
        let [scale, shift] = ["scale", "shift"].map(|it| self.parameter(&format!("{name}.{it}")));
        let at = self.next;
        let [mean, variance] =
            ["mean", "variance"].map(|it| self.parameter(&format!("{name}.{it}")));
        let (mean, variance) = if self.dice.is_some() {
            let flat = of.clone().reshape([n, channels, rows * cols]);
            let mean = flat.clone().mean_dim(2).mean_dim(0);
            let off = flat - mean.clone();
            let variance = (off.clone() * off).mean_dim(2).mean_dim(0);
            let (mean, variance) = (mean.reshape([channels]), variance.reshape([channels]));
            self.seen.push(BatchStatistics {
                at,
                mean: mean.clone().detach(),
                variance: variance.clone().detach(),
            });
            (mean, variance)
        } else {
            (mean, variance)
        };
        let factor = scale / (variance + EPSILON).sqrt();
        let shift = shift - mean * factor.clone();
        of * factor.reshape([1, channels, 1, 1]) + shift.reshape([1, channels, 1, 1])
    }

    /// Weights about every part along one side of a map, `[n, parts, cells]`.
    fn weights(&self, columns: &[usize], (cells, side): (usize, f32), deviation: f32) -> Tensor<3> {
        let evidence = self
            .evidence
            .clone()
            .map(|it| it.into_data_as::<f32>().try_into_vec::<f32>());
        let evidence = evidence.and_then(Result::ok).unwrap_or_default();
        let width = self.evidence.as_ref().map_or(1, |it| it.dims()[1]);
        let (centres, factor) = cells_along(cells, side, deviation);
        let n = evidence.len() / width;
        let weight = |place: f32, centre: f32| ((place - centre).powi(2) * factor).exp();
        let values: Vec<f32> = evidence
            .chunks_exact(width)
            .flat_map(|row| columns.iter().map(|it| row[*it]))
            .flat_map(|place| centres.iter().map(move |it| weight(place, *it)))
            .collect();
        let data = TensorData::new(values, [n, columns.len(), cells]);
        Tensor::from_data(data, self.device)
    }
}

impl Ops for Forward<'_> {
    type Value = Value;

    #[expect(clippy::expect_used, reason = "the caller gives what the network sees")]
    fn tile(&mut self) -> Value {
        Value::Map(
            self.tile
                .take()
                .expect("tiles for a network that sees them"),
        )
    }

    #[expect(clippy::expect_used, reason = "the caller gives what the network sees")]
    fn evidence(&mut self) -> Value {
        let mean = self.parameter("evidence.mean");
        let factor = self.parameter("evidence.factor");
        let evidence = self.evidence.clone();
        let evidence = evidence.expect("evidence for a network that sees it");
        Value::List((evidence - mean.unsqueeze::<2>()) * factor.unsqueeze::<2>())
    }

    fn conv(&mut self, of: &Value, name: &str, conv: Conv) -> Value {
        let dims: [usize; 4] = core::array::from_fn(|it| self.sizes(self.next)[it]);
        let weight = self.parameter(&format!("{name}.weight")).reshape(dims);
        let bias = (!conv.normalised).then(|| self.parameter(&format!("{name}.bias")));
        let groups = if conv.by_channel { conv.channels } else { 1 };
        let options = ConvOptions::new([conv.stride; 2], [conv.kernel / 2; 2], [1, 1], groups);
        let sum = module::conv2d(of.map(), weight, bias, options);
        let sum = if conv.normalised {
            self.normalised(sum, name)
        } else {
            sum
        };
        Value::Map(activation::relu(sum))
    }

    fn pool(&mut self, of: &Value) -> Value {
        Value::Map(module::max_pool2d(of.map(), MaxPoolOptions::new([2, 2])))
    }

    fn mean(&mut self, of: &Value) -> Value {
        let map = of.map();
        let [n, channels, rows, cols] = map.dims();
        let mean = map.reshape([n, channels, rows * cols]).mean_dim(2);
        Value::List(mean.reshape([n, channels]))
    }

    fn flat(&mut self, of: &Value) -> Value {
        let map = of.map();
        let [n, channels, rows, cols] = map.dims();
        Value::List(map.reshape([n, channels * rows * cols]))
    }

    fn look(&mut self, of: &Value, places: &Places, deviation: f32) -> Value {
        let map = of.map();
        let [n, channels, rows, cols] = map.dims();
        let parts = places.x.len();
        let x = self
            .weights(&places.x, (cols, self.width), deviation)
            .reshape([n, parts, 1, cols]);
        let y = self
            .weights(&places.y, (rows, 1.0), deviation)
            .reshape([n, parts, rows, 1]);
        let both = (y * x).reshape([n, parts, rows * cols]);
        let map = map.reshape([n, channels, rows * cols]).swap_dims(1, 2);
        Value::List(both.matmul(map).reshape([n, parts * channels]))
    }

    fn join(&mut self, of: &[&Value]) -> Value {
        Value::List(Tensor::cat(of.iter().map(|it| it.list()).collect(), 1))
    }

    fn dense(&mut self, of: &Value, name: &str, values: usize) -> Value {
        let inputs = self.sizes(self.next)[1];
        let weight = self
            .parameter(&format!("{name}.weight"))
            .reshape([values, inputs]);
        let bias = self.parameter(&format!("{name}.bias"));
        Value::List(of.list().matmul(weight.transpose()) + bias.unsqueeze::<2>())
    }

    fn prelu(&mut self, of: &Value, name: &str) -> Value {
        let slope = self.parameter(name).unsqueeze::<2>();
        let positive = activation::relu(of.list());
        let negative = of.list() - positive.clone();
        Value::List(positive + negative * slope)
    }

    fn dropout(&mut self, of: &Value, share: f32) -> Value {
        let list = of.list();
        let [n, values] = list.dims();
        let Some(dice) = self.dice.as_deref_mut() else {
            return of.clone();
        };
        let kept = 1.0 / (1.0 - share);
        let mask: Vec<f32> = (0..n * values)
            .map(|_| if dice.f32() < share { 0.0 } else { kept })
            .collect();
        let mask = Tensor::from_data(TensorData::new(mask, [n, values]), self.device);
        Value::List(list * mask)
    }
}
