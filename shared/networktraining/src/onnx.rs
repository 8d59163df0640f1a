//! A trained network as an ONNX file.

use onnx::{Attribute, Network, Side};

use crate::network::{self, Conv, Ops, Shape, grid};
use crate::parameters::{Dims, Parameter, convolved, standardised};

/// Name of the input, `[n, 3, height, width]`.
pub const PICTURE: &str = "picture";
/// Name of the output with the log-odds of every joint in every cell, `[n, joints, rows, columns]`.
pub const MAPS: &str = "maps";
/// Name of the output with the evidence for the direction of the trunk, `[n, 2]`.
pub const FRONT: &str = "front";
/// Name of the output with the expected errors of the joints in heights of the input, `[n, joints]`.
pub const ERROR: &str = "error";

/// Writes a network; the standardised weights become plain ones, in half precision.
///
/// * `parameters`: in the order of [`initial`](crate::initial).
/// * `metadata`: keys and values that the file carries.
///
/// # Panics
///
/// If the parameters are another network's.
pub fn write(shape: &Shape, parameters: &[Parameter], metadata: &[(String, String)]) -> Vec<u8> {
    let mut writer = Writer {
        graph: Network {
            name: "pose".to_owned(),
            producer: Some(("parallax".to_owned(), env!("CARGO_PKG_VERSION").to_owned())),
            metadata: metadata.to_vec(),
            ..Network::default()
        },
        shape,
        parameters: parameters.iter(),
        n: 0,
    };
    let found = network::run(&mut writer, shape);
    let error = writer.node(
        "Exp",
        &[&found.error.name],
        vec![],
        found.error.dims.clone(),
    );
    let mut graph = writer.graph;
    for (name, value) in [(MAPS, &found.maps), (FRONT, &found.front), (ERROR, &error)] {
        graph.node("Identity", &[&value.name], name, vec![]);
        graph.outputs.push(batched(name, &value.dims));
    }
    graph
        .inputs
        .push(batched(PICTURE, &[3, shape.height, shape.width]));
    graph.file()
}

/// An input or output `[n, dims...]`, where `n` is the batch.
fn batched(name: &str, dims: &[usize]) -> (String, Vec<Side>) {
    let dims = dims.iter().map(|&dim| Side::Fixed(dim));
    let shape = core::iter::once(Side::Named("n")).chain(dims);
    (name.to_owned(), shape.collect())
}

fn ints(all: &[usize]) -> Attribute {
    Attribute::Ints(all.iter().map(|&value| value as i64).collect())
}

/// A value of the graph.
#[derive(Debug, Clone)]
struct Value {
    name: String,
    /// Without the batch.
    dims: Dims,
}

struct Writer<'a> {
    graph: Network,
    shape: &'a Shape,
    parameters: core::slice::Iter<'a, Parameter>,
    n: usize,
}

impl<'a> Writer<'a> {
    #[expect(
        clippy::expect_used,
        reason = "documented: the caller's parameters fit the network"
    )]
    fn parameter(&mut self, name: &str) -> &'a Parameter {
        let found = self.parameters.next().expect("a parameter for every layer");
        assert_eq!(found.name, name, "parameters in the order of the layers");
        found
    }

    fn node(
        &mut self,
        operator: &str,
        inputs: &[&str],
        attributes: Vec<(&'static str, Attribute)>,
        dims: Dims,
    ) -> Value {
        self.n += 1;
        let name = format!("{}_{}", operator.to_lowercase(), self.n);
        self.graph.node(operator, inputs, &name, attributes);
        Value { name, dims }
    }

    /// Another shape for a value, `[n, dims...]`.
    fn reshaped(&mut self, of: &Value, dims: &[usize]) -> Value {
        let shape = format!("shape_{}", self.n);
        let sizes = core::iter::once(-1).chain(dims.iter().map(|it| *it as i64));
        self.graph.ints(&shape, sizes.collect());
        self.node("Reshape", &[&of.name, &shape], vec![], dims.to_vec())
    }

    /// The cells of every channel in a row.
    fn rows(&mut self, of: &Value) -> Value {
        let dims = [of.dims[0], of.dims[1..].iter().product()];
        self.reshaped(of, &dims)
    }

    /// The softmax over the cells of every map.
    fn softmax(&mut self, maps: &Value, sharpness: f32) -> Value {
        let factor = format!("sharpness_{}", self.n);
        self.graph.floats(&factor, &[1], vec![sharpness]);
        let maps = self.rows(maps);
        let dims = maps.dims.clone();
        let sharp = self.node("Mul", &[&maps.name, &factor], vec![], dims.clone());
        let axis = vec![("axis", Attribute::Int(2))];
        self.node("Softmax", &[&sharp.name], axis, dims)
    }

    fn flat(&mut self, of: &Value) -> Value {
        let dims = vec![of.dims.iter().product()];
        let axis = vec![("axis", Attribute::Int(1))];
        self.node("Flatten", &[&of.name], axis, dims)
    }
}

impl Ops for Writer<'_> {
    type Value = Value;

    fn picture(&mut self) -> Value {
        Value {
            name: PICTURE.to_owned(),
            dims: vec![3, self.shape.height, self.shape.width],
        }
    }

    fn conv(&mut self, of: &Value, name: &str, conv: Conv) -> Value {
        let [of_weight, of_gain, of_bias] =
            ["weight", "gain", "bias"].map(|it| format!("{name}.{it}"));
        let weight = self.parameter(&of_weight);
        let gain = self.parameter(&of_gain);
        let bias = self.parameter(&of_bias);
        let weights = standardised(&weight.values, &gain.values);
        self.graph.halves(&of_weight, &weight.dims, &weights);
        self.graph
            .floats(&of_bias, &[conv.channels], bias.values.clone());
        let attributes = vec![
            ("kernel_shape", ints(&[conv.kernel; 2])),
            ("strides", ints(&[conv.stride; 2])),
            ("pads", ints(&[conv.kernel / 2; 4])),
        ];
        let dims = convolved(&of.dims, conv);
        let inputs = [of.name.as_str(), &of_weight, &of_bias];
        self.node("Conv", &inputs, attributes, dims)
    }

    fn relu(&mut self, of: &Value) -> Value {
        self.node("Relu", &[&of.name], vec![], of.dims.clone())
    }

    fn add(&mut self, a: &Value, b: &Value) -> Value {
        self.node("Add", &[&a.name, &b.name], vec![], a.dims.clone())
    }

    fn doubled(&mut self, of: &Value) -> Value {
        let factors = format!("factors_{}", self.n);
        self.graph.floats(&factors, &[4], vec![1.0, 1.0, 2.0, 2.0]);
        let dims = vec![of.dims[0], 2 * of.dims[1], 2 * of.dims[2]];
        // Of the nearest neighbour, rounded down: every cell becomes four equal ones.
        self.node("Resize", &[&of.name, "", &factors], vec![], dims)
    }

    fn mean(&mut self, of: &Value) -> Value {
        let n = of.dims[0];
        let mean = self.node("GlobalAveragePool", &[&of.name], vec![], vec![n, 1, 1]);
        self.flat(&mean)
    }

    fn fixed(&mut self, of: &Value) -> Value {
        of.clone()
    }

    fn look(&mut self, of: &Value, maps: &Value, sharpness: f32) -> Value {
        let weights = self.softmax(maps, sharpness);
        let dims = weights.dims.clone();
        let features = self.rows(of);
        let turned = vec![features.dims[1], features.dims[0]];
        let turn = vec![("perm", ints(&[0, 2, 1]))];
        let features = self.node("Transpose", &[&features.name], turn, turned);
        let dims = vec![dims[0], features.dims[1]];
        let looked = self.node("MatMul", &[&weights.name, &features.name], vec![], dims);
        self.flat(&looked)
    }

    fn place(&mut self, maps: &Value, sharpness: f32) -> Value {
        let weights = self.softmax(maps, sharpness);
        let dims = weights.dims.clone();
        let cells = format!("grid_{}", self.n);
        let values = grid(maps.dims[2], maps.dims[1]);
        self.graph.floats(&cells, &[dims[1], 3], values);
        let dims = vec![dims[0], 3];
        let places = self.node("MatMul", &[&weights.name, &cells], vec![], dims);
        self.flat(&places)
    }

    fn highest(&mut self, of: &Value) -> Value {
        let attributes = vec![("axes", ints(&[2, 3])), ("keepdims", Attribute::Int(0))];
        self.node("ReduceMax", &[&of.name], attributes, vec![of.dims[0]])
    }

    fn join(&mut self, of: &[&Value]) -> Value {
        let names: Vec<&str> = of.iter().map(|it| it.name.as_str()).collect();
        let dims = vec![of.iter().map(|it| it.dims[0]).sum()];
        self.node("Concat", &names, vec![("axis", Attribute::Int(1))], dims)
    }

    fn dense(&mut self, of: &Value, name: &str, values: usize) -> Value {
        let [weight, bias] = ["weight", "bias"].map(|it| format!("{name}.{it}"));
        let found = self.parameter(&weight);
        self.graph.halves(&weight, &found.dims, &found.values);
        let found = self.parameter(&bias);
        self.graph.floats(&bias, &found.dims, found.values.clone());
        let attributes = vec![("transB", Attribute::Int(1))];
        self.node(
            "Gemm",
            &[&of.name, &weight, &bias],
            attributes,
            vec![values],
        )
    }
}
