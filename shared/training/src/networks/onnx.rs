//! A trained network as an ONNX file.

use inference::onnx::{Attribute, Network as Graph, Side};

use crate::networks::ops::{
    Along, Conv, Dims, Network, Ops, Places, Scaling, convolved, grid, joined,
};
use crate::networks::parameters::{EPSILON_OF_BATCH, Parameter, standardised};

/// Options for writing a network.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Document {
    /// Name of the graph.
    pub name: String,
    /// Keys and values of the file's metadata.
    pub metadata: Vec<(String, String)>,
    /// True if weights are stored in half precision.
    pub has_half_weights: bool,
}

/// Writes a network. Standardised weights become plain weights, batch normalisation is merged into the convolutions, and dropout is
/// removed.
///
/// * `parameters`: in the order of [`initial`](crate::networks::initial).
///
/// # Panics
///
/// Panics if the parameters belong to a different network.
pub fn write(network: &impl Network, parameters: &[Parameter], document: Document) -> Vec<u8> {
    let inputs = network.inputs();
    let mut writer = Writer {
        graph: Graph {
            name: document.name,
            producer: Some(("parallax".to_owned(), env!("CARGO_PKG_VERSION").to_owned())),
            metadata: document.metadata,
            inputs: inputs.iter().map(|(name, dims)| batched(name, dims)).collect(),
            ..Graph::default()
        },
        has_half_weights: document.has_half_weights,
        inputs,
        parameters: parameters.iter(),
        n: 0,
    };
    let found = network.run(&mut writer);
    let mut graph = writer.graph;
    for (output, value) in network.outputs().iter().zip(found) {
        let operator = if output.is_logarithm {
            "Exp"
        } else {
            "Identity"
        };
        graph.node(operator, &[&value.name], output.name, vec![]);
        graph.outputs.push(batched(output.name, &value.dims));
    }
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
    /// Dimensions, without the dimension of the batch.
    dims: Dims,
}

/// Weights and bias of a convolution in the form used in the file.
struct Folded {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

struct Writer<'a> {
    graph: Graph,
    has_half_weights: bool,
    inputs: Vec<(&'static str, Dims)>,
    parameters: core::slice::Iter<'a, Parameter>,
    n: usize,
}

impl<'a> Writer<'a> {
    #[expect(
        clippy::expect_used,
        reason = "the panic is documented: the caller's parameters must fit the network"
    )]
    fn parameter(&mut self, name: &str) -> &'a Parameter {
        let found = self.parameters.next().expect("there must be a parameter for every layer");
        assert_eq!(
            found.name, name,
            "parameters must be in the order of the layers"
        );
        found
    }

    /// Writes a parameter without change.
    fn constant(&mut self, name: &str) -> &'a Parameter {
        let found = self.parameter(name);
        self.graph.floats(name, &found.dims, found.values.clone());
        found
    }

    fn weights(&mut self, name: &str, dims: &[usize], values: Vec<f32>) {
        if self.has_half_weights {
            self.graph.halves(name, dims, &values);
        } else {
            self.graph.floats(name, dims, values);
        }
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

    /// Reshapes a value to `[n, dims...]`.
    fn reshaped(&mut self, value: &Value, dims: &[usize]) -> Value {
        let shape = format!("shape_{}", self.n);
        let sizes = core::iter::once(-1).chain(dims.iter().map(|dim| *dim as i64));
        self.graph.ints(&shape, sizes.collect());
        self.node("Reshape", &[&value.name, &shape], vec![], dims.to_vec())
    }

    /// Reshapes a map so that the cells of every channel form a row.
    fn rows(&mut self, map: &Value) -> Value {
        let dims = [map.dims[0], map.dims[1..].iter().product()];
        self.reshaped(map, &dims)
    }

    /// Weights of the cells along one side of a map for every position, `[n, positions, cells]`.
    fn along(&mut self, list: &Value, columns: &[usize], along: &Along) -> Value {
        let id = self.n;
        let [index, centre, scale] =
            ["index", "centre", "scale"].map(|what| format!("{what}_{id}"));
        let (n, cells) = (columns.len(), along.centres.len());
        let columns = columns.iter().map(|column| *column as i64);
        self.graph.ints(&index, columns.collect());
        self.graph.floats(&centre, &[1, 1, cells], along.centres.clone());
        self.graph.floats(&scale, &[1], vec![along.factor]);
        let axis = vec![("axis", Attribute::Int(1))];
        let places = self.node("Gather", &[&list.name, &index], axis, vec![n]);
        let places = self.reshaped(&places, &[n, 1]);
        let dims = vec![n, cells];
        let off = self.node("Sub", &[&places.name, &centre], vec![], dims.clone());
        let squared = self.node("Mul", &[&off.name, &off.name], vec![], dims.clone());
        let scaled = self.node("Mul", &[&squared.name, &scale], vec![], dims.clone());
        self.node("Exp", &[&scaled.name], vec![], dims)
    }

    /// Takes the parameters of a convolution, and merges their scaling into weights and bias.
    fn folded(&mut self, name: &str, weight: &Parameter, scaling: Scaling) -> Folded {
        let mut values = |what: &str| &self.parameter(&format!("{name}.{what}")).values;
        match scaling {
            Scaling::Plain => Folded {
                weights: weight.values.clone(),
                bias: values("bias").clone(),
            },
            Scaling::Standardised { .. } => Folded {
                weights: standardised(&weight.values, values("gain")),
                bias: values("bias").clone(),
            },
            Scaling::Batch => {
                let [scale, shift, mean, variance] =
                    ["scale", "shift", "mean", "variance"].map(values);
                let factors = scale.iter().zip(variance);
                let factors: Vec<f32> = factors
                    .map(|(scale, variance)| scale / (variance + EPSILON_OF_BATCH).sqrt())
                    .collect();
                let channels = weight.values.chunks_exact(weight.values.len() / factors.len());
                let weights = channels.zip(&factors);
                let bias = shift.iter().zip(mean).zip(&factors);
                Folded {
                    weights: weights
                        .flat_map(|(channel, factor)| {
                            channel.iter().map(move |value| value * factor)
                        })
                        .collect(),
                    bias: bias.map(|((shift, mean), factor)| shift - mean * factor).collect(),
                }
            }
        }
    }
}

impl Ops for Writer<'_> {
    type Value = Value;

    fn input(&mut self, name: &'static str) -> Value {
        let found = self.inputs.iter().find(|input| input.0 == name);
        Value {
            name: name.to_owned(),
            dims: found.map(|input| input.1.clone()).unwrap_or_default(),
        }
    }

    fn centred(&mut self, list: &Value, name: &str) -> Value {
        let [mean, factor] = ["mean", "factor"].map(|what| format!("{name}.{what}"));
        self.constant(&mean);
        self.constant(&factor);
        let off = self.node("Sub", &[&list.name, &mean], vec![], list.dims.clone());
        self.node("Mul", &[&off.name, &factor], vec![], list.dims.clone())
    }

    fn conv(&mut self, map: &Value, name: &str, conv: Conv) -> Value {
        let [of_weight, of_bias] = ["weight", "bias"].map(|what| format!("{name}.{what}"));
        let weight = self.parameter(&of_weight);
        let folded = self.folded(name, weight, conv.scaling);
        self.weights(&of_weight, &weight.dims, folded.weights);
        self.graph.floats(&of_bias, &[conv.channels], folded.bias);
        let group = if conv.by_channel { conv.channels } else { 1 };
        let attributes = vec![
            ("kernel_shape", ints(&[conv.kernel; 2])),
            ("strides", ints(&[conv.stride; 2])),
            ("pads", ints(&[conv.kernel / 2; 4])),
            ("group", Attribute::Int(group as i64)),
        ];
        let dims = convolved(&map.dims, conv);
        let inputs = [map.name.as_str(), &of_weight, &of_bias];
        self.node("Conv", &inputs, attributes, dims)
    }

    fn relu(&mut self, value: &Value) -> Value {
        self.node("Relu", &[&value.name], vec![], value.dims.clone())
    }

    fn add(&mut self, a: &Value, b: &Value) -> Value {
        self.node("Add", &[&a.name, &b.name], vec![], a.dims.clone())
    }

    fn doubled(&mut self, map: &Value) -> Value {
        let factors = format!("factors_{}", self.n);
        self.graph.floats(&factors, &[4], vec![1.0, 1.0, 2.0, 2.0]);
        let dims = vec![map.dims[0], 2 * map.dims[1], 2 * map.dims[2]];
        // Upsampling by nearest neighbour, rounded down: every cell becomes four equal cells.
        self.node("Resize", &[&map.name, "", &factors], vec![], dims)
    }

    fn pool(&mut self, map: &Value) -> Value {
        let two = ints(&[2, 2]);
        let attributes = vec![("kernel_shape", two.clone()), ("strides", two)];
        let dims = vec![map.dims[0], map.dims[1] / 2, map.dims[2] / 2];
        self.node("MaxPool", &[&map.name], attributes, dims)
    }

    fn mean(&mut self, map: &Value) -> Value {
        let dims = vec![map.dims[0], 1, 1];
        let mean = self.node("GlobalAveragePool", &[&map.name], vec![], dims);
        self.flat(&mean)
    }

    fn highest(&mut self, map: &Value) -> Value {
        let attributes = vec![("axes", ints(&[2, 3])), ("keepdims", Attribute::Int(0))];
        self.node("ReduceMax", &[&map.name], attributes, vec![map.dims[0]])
    }

    fn flat(&mut self, map: &Value) -> Value {
        let dims = vec![map.dims.iter().product()];
        let axis = vec![("axis", Attribute::Int(1))];
        self.node("Flatten", &[&map.name], axis, dims)
    }

    fn fixed(&mut self, value: &Value) -> Value {
        value.clone()
    }

    fn softmax(&mut self, maps: &Value, sharpness: f32) -> Value {
        let factor = format!("sharpness_{}", self.n);
        self.graph.floats(&factor, &[1], vec![sharpness]);
        let rows = self.rows(maps);
        let sharp = self.node("Mul", &[&rows.name, &factor], vec![], rows.dims);
        let axis = vec![("axis", Attribute::Int(2))];
        let name = self.node("Softmax", &[&sharp.name], axis, sharp.dims).name;
        // The value already has this layout; the next operations only use its name.
        Value {
            name,
            dims: maps.dims.clone(),
        }
    }

    fn around(&mut self, list: &Value, like: &Value, places: &Places) -> Value {
        let (n, rows, columns) = (places.x.len(), like.dims[1], like.dims[2]);
        let across = Along::new(columns, places.width, places.deviation);
        let down = Along::new(rows, 1.0, places.deviation);
        let x = self.along(list, &places.x, &across);
        let y = self.along(list, &places.y, &down);
        let x = self.reshaped(&x, &[n, 1, columns]);
        let y = self.reshaped(&y, &[n, rows, 1]);
        self.node("Mul", &[&y.name, &x.name], vec![], vec![n, rows, columns])
    }

    fn look(&mut self, map: &Value, weights: &Value) -> Value {
        let weights = self.rows(weights);
        let map = self.rows(map);
        let turned = vec![map.dims[1], map.dims[0]];
        let turn = vec![("perm", ints(&[0, 2, 1]))];
        let map = self.node("Transpose", &[&map.name], turn, turned);
        let dims = vec![weights.dims[0], map.dims[1]];
        let looked = self.node("MatMul", &[&weights.name, &map.name], vec![], dims);
        self.flat(&looked)
    }

    fn place(&mut self, weights: &Value) -> Value {
        let cells = format!("grid_{}", self.n);
        let values = grid(weights.dims[2], weights.dims[1]);
        self.graph.floats(&cells, &[values.len() / 3, 3], values);
        let weights = self.rows(weights);
        let dims = vec![weights.dims[0], 3];
        let places = self.node("MatMul", &[&weights.name, &cells], vec![], dims);
        self.flat(&places)
    }

    fn join(&mut self, lists: &[&Value]) -> Value {
        let names: Vec<&str> = lists.iter().map(|list| list.name.as_str()).collect();
        let dims: Vec<&[usize]> = lists.iter().map(|list| list.dims.as_slice()).collect();
        let dims = joined(&dims);
        self.node("Concat", &names, vec![("axis", Attribute::Int(1))], dims)
    }

    fn dense(&mut self, list: &Value, name: &str, values: usize) -> Value {
        let [weight, bias] = ["weight", "bias"].map(|what| format!("{name}.{what}"));
        let found = self.parameter(&weight);
        self.weights(&weight, &found.dims, found.values.clone());
        self.constant(&bias);
        let attributes = vec![("transB", Attribute::Int(1))];
        let inputs = [list.name.as_str(), &weight, &bias];
        self.node("Gemm", &inputs, attributes, vec![values])
    }

    fn prelu(&mut self, list: &Value, name: &str) -> Value {
        self.constant(name);
        self.node("PRelu", &[&list.name, name], vec![], list.dims.clone())
    }

    fn dropout(&mut self, list: &Value, _: f32) -> Value {
        list.clone()
    }
}
