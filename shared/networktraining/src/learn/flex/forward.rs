//! The forward pass of the network in burn, recorded for the backward pass.

use burn_tensor::ops::{ConvOptions, InterpolateMode, InterpolateOptions};
use burn_tensor::{DType, Tensor, TensorData, activation, module};

use crate::network::{Conv, Ops, grid};
use crate::parameters::{EPSILON, GAIN_OF_RELU, Parameter};

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
    pub(super) fn map(&self) -> Tensor<4> {
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

/// Runs a network on a batch.
pub(super) struct Forward<'a> {
    /// Names and sizes.
    pub(super) parameters: &'a [Parameter],
    /// The same values as flat tensors.
    pub(super) tensors: &'a [Tensor<1>],
    pub(super) picture: Tensor<4>,
    /// Type of the numbers in maps.
    pub(super) numbers: DType,
    /// Number of the next parameter.
    pub(super) next: usize,
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

    /// The standardised weights of a convolution: [`standardised`](crate::parameters::standardised).
    fn weight(&mut self, name: &str) -> Tensor<4> {
        let dims: [usize; 4] = core::array::from_fn(|it| self.parameters[self.next].dims[it]);
        let weight = self.parameter(&format!("{name}.weight"));
        let gain = self.parameter(&format!("{name}.gain"));
        let n_inputs = dims[1] * dims[2] * dims[3];
        let rows = weight.reshape([dims[0], n_inputs]);
        let rows = rows.clone() - rows.mean_dim(1);
        let length = ((rows.clone() * rows.clone()).sum_dim(1) + EPSILON).sqrt();
        let factor = gain.reshape([dims[0], 1]) * GAIN_OF_RELU / length;
        (rows * factor).reshape(dims).cast(self.numbers)
    }
}

/// The cells of every channel in a row, single precision.
fn rows(of: Tensor<4>) -> Tensor<3> {
    let [n, channels, rows, columns] = of.dims();
    of.cast(DType::F32).reshape([n, channels, rows * columns])
}

impl Ops for Forward<'_> {
    type Value = Value;

    fn picture(&mut self) -> Value {
        Value::Map(self.picture.clone().cast(self.numbers))
    }

    fn conv(&mut self, of: &Value, name: &str, conv: Conv) -> Value {
        let weight = self.weight(name);
        let bias = self.parameter(&format!("{name}.bias")).cast(self.numbers);
        let options = ConvOptions::new([conv.stride; 2], [conv.kernel / 2; 2], [1, 1], 1);
        Value::Map(module::conv2d(of.map(), weight, Some(bias), options))
    }

    fn relu(&mut self, of: &Value) -> Value {
        match of {
            Value::Map(it) => Value::Map(activation::relu(it.clone())),
            Value::List(it) => Value::List(activation::relu(it.clone())),
        }
    }

    fn add(&mut self, a: &Value, b: &Value) -> Value {
        Value::Map(a.map() + b.map())
    }

    fn doubled(&mut self, of: &Value) -> Value {
        let map = of.map();
        let [_, _, rows, columns] = map.dims();
        let options = InterpolateOptions::new(InterpolateMode::Nearest)
            .with_output_size([2 * rows, 2 * columns]);
        Value::Map(module::interpolate(map, options))
    }

    fn mean(&mut self, of: &Value) -> Value {
        let [n, channels, _, _] = of.map().dims();
        Value::List(rows(of.map()).mean_dim(2).reshape([n, channels]))
    }

    fn fixed(&mut self, of: &Value) -> Value {
        match of {
            Value::Map(it) => Value::Map(it.clone().detach()),
            Value::List(it) => Value::List(it.clone().detach()),
        }
    }

    fn look(&mut self, of: &Value, maps: &Value, sharpness: f32) -> Value {
        let weights = activation::softmax(rows(maps.map()) * sharpness, 2);
        let features = rows(of.map());
        let [n, n_maps, _] = weights.dims();
        let [_, channels, _] = features.dims();
        let looked = weights.matmul(features.swap_dims(1, 2));
        Value::List(looked.reshape([n, n_maps * channels]))
    }

    fn place(&mut self, maps: &Value, sharpness: f32) -> Value {
        let maps = maps.map();
        let [n, n_maps, n_rows, n_columns] = maps.dims();
        let grid = TensorData::new(grid(n_columns, n_rows), [1, n_rows * n_columns, 3]);
        let grid: Tensor<3> = Tensor::from_data(grid, &maps.device());
        let weights = activation::softmax(rows(maps) * sharpness, 2);
        let places = weights.matmul(grid.repeat_dim(0, n));
        Value::List(places.reshape([n, 3 * n_maps]))
    }

    fn highest(&mut self, of: &Value) -> Value {
        let [n, channels, _, _] = of.map().dims();
        Value::List(rows(of.map()).max_dim(2).reshape([n, channels]))
    }

    fn join(&mut self, of: &[&Value]) -> Value {
        Value::List(Tensor::cat(of.iter().map(|it| it.list()).collect(), 1))
    }

    fn dense(&mut self, of: &Value, name: &str, _: usize) -> Value {
        let dims: [usize; 2] = core::array::from_fn(|it| self.parameters[self.next].dims[it]);
        let weight = self.parameter(&format!("{name}.weight")).reshape(dims);
        let bias = self.parameter(&format!("{name}.bias"));
        Value::List(of.list().matmul(weight.transpose()) + bias.unsqueeze::<2>())
    }
}
