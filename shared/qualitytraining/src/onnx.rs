//! A trained network as an ONNX file.

use onnx::{Attribute, Network, Side};

use crate::network::{self, Conv, Kind, Ops, Places, Shape};
use crate::parameters::{Dims, Inputs, Parameter, convolved};

/// Name of the input that takes the tile, `[n, 3, height, width]`.
pub const TILE: &str = "tile";
/// Name of the input that takes the evidence, `[n, values]`.
pub const EVIDENCE: &str = "evidence";
/// Name of the output, `[n, parts]`.
pub const SIGMA: &str = "sigma";

/// Added to a variance before the root is taken.
pub(crate) const EPSILON: f32 = 1e-5;

/// Writes a network: batch normalisations become part of the convolutions, dropout goes.
///
/// * `parameters`: in the order of [`initial`](crate::parameters::initial).
/// * `metadata`: keys and values that the file carries.
///
/// # Panics
///
/// If the parameters are another network's.
pub fn write(
    shape: &Shape,
    inputs: &Inputs,
    parameters: &[Parameter],
    metadata: &[(String, String)],
) -> Vec<u8> {
    let mut writer = Writer {
        graph: Network {
            name: Kind::name(shape.kind).to_owned(),
            producer: Some(("parallax".to_owned(), env!("CARGO_PKG_VERSION").to_owned())),
            metadata: metadata.to_vec(),
            ..Network::default()
        },
        inputs,
        parameters: parameters.iter(),
        n: 0,
    };
    let found = network::run(&mut writer, shape);
    let mut graph = writer.graph;
    graph.node("Identity", &[&found.name], SIGMA, vec![]);
    graph.outputs.push(batched(SIGMA, &found.dims));
    if let Some(tile) = shape.kind.tile() {
        debug_assert_eq!(tile.len(), 2, "height and width");
        let dims = [3, inputs.tile[0], inputs.tile[1]];
        graph.inputs.push(batched(TILE, &dims));
    }
    if shape.kind.sees_evidence() {
        let dims = [inputs.evidence_mean.len()];
        graph.inputs.push(batched(EVIDENCE, &dims));
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
    /// Without the batch.
    dims: Dims,
}

struct Writer<'a> {
    graph: Network,
    inputs: &'a Inputs,
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

    /// Writes a parameter as it is.
    fn constant(&mut self, name: &str) -> &'a Parameter {
        let found = self.parameter(name);
        self.graph.floats(name, &found.dims, found.values.clone());
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

    /// Weights about every part along one side of a map, `[n, parts, cells]`.
    fn weights(&mut self, columns: &[usize], (cells, side): (usize, f32), deviation: f32) -> Value {
        let id = self.n;
        let [index, centre, scale] = ["index", "centre", "scale"].map(|it| format!("{it}_{id}"));
        let n = columns.len();
        self.graph
            .ints(&index, columns.iter().map(|it| *it as i64).collect());
        let (centres, factor) = cells_along(cells, side, deviation);
        self.graph.floats(&centre, &[1, 1, cells], centres);
        self.graph.floats(&scale, &[1], vec![factor]);
        let axis = vec![("axis", Attribute::Int(1))];
        let places = self.node("Gather", &[EVIDENCE, &index], axis, vec![n]);
        let places = self.reshaped(&places, &[n, 1]);
        let dims = vec![n, cells];
        let off = self.node("Sub", &[&places.name, &centre], vec![], dims.clone());
        let squared = self.node("Mul", &[&off.name, &off.name], vec![], dims.clone());
        let scaled = self.node("Mul", &[&squared.name, &scale], vec![], dims.clone());
        self.node("Exp", &[&scaled.name], vec![], dims)
    }
}

/// The cells along one side of a map: where their centres lie, and what the squared distance from them is
/// multiplied with to look at what is within `deviation` cells.
///
/// * `side`: its length in heights of the tile, in which the places and the centres count.
pub(crate) fn cells_along(cells: usize, side: f32, deviation: f32) -> (Vec<f32>, f32) {
    let cell = side / cells as f32;
    let centre = |it: usize| (it as f32 + 0.5) * cell - 0.5 * side;
    let factor = -0.5 / (deviation * cell).powi(2);
    ((0..cells).map(centre).collect(), factor)
}

/// Width of a tile in its heights.
pub(crate) fn width_of(tile: [usize; 2]) -> f32 {
    tile[1] as f32 / tile[0] as f32
}

impl Ops for Writer<'_> {
    type Value = Value;

    fn tile(&mut self) -> Value {
        Value {
            name: TILE.to_owned(),
            dims: vec![3, self.inputs.tile[0], self.inputs.tile[1]],
        }
    }

    fn evidence(&mut self) -> Value {
        let dims = self.constant("evidence.mean").dims.clone();
        self.constant("evidence.factor");
        let off = self.node("Sub", &[EVIDENCE, "evidence.mean"], vec![], dims.clone());
        self.node("Mul", &[&off.name, "evidence.factor"], vec![], dims)
    }

    fn conv(&mut self, of: &Value, name: &str, conv: Conv) -> Value {
        let weight = self.parameter(&format!("{name}.weight"));
        let mut weights = weight.values.clone();
        let bias = if conv.normalised {
            let [scale, shift, mean, variance] = ["scale", "shift", "mean", "variance"]
                .map(|it| &self.parameter(&format!("{name}.{it}")).values);
            let factors = scale
                .iter()
                .zip(variance)
                .map(|(s, v)| s / (v + EPSILON).sqrt());
            let factors: Vec<f32> = factors.collect();
            let per_channel = weights.len() / conv.channels;
            for (weights, factor) in weights.chunks_exact_mut(per_channel).zip(&factors) {
                for it in weights {
                    *it *= factor;
                }
            }
            let bias = shift.iter().zip(mean).zip(&factors);
            bias.map(|((shift, mean), factor)| shift - mean * factor)
                .collect()
        } else {
            self.parameter(&format!("{name}.bias")).values.clone()
        };
        let [of_weight, of_bias] = ["weight", "bias"].map(|it| format!("{name}.{it}"));
        self.graph.floats(&of_weight, &weight.dims, weights);
        self.graph.floats(&of_bias, &[conv.channels], bias);
        let group = if conv.by_channel { conv.channels } else { 1 };
        let half = conv.kernel / 2;
        let attributes = vec![
            ("kernel_shape", ints(&[conv.kernel; 2])),
            ("strides", ints(&[conv.stride; 2])),
            ("pads", ints(&[half; 4])),
            ("group", Attribute::Int(group as i64)),
        ];
        let dims = convolved(&of.dims, conv);
        let inputs = [of.name.as_str(), &of_weight, &of_bias];
        let sum = self.node("Conv", &inputs, attributes, dims.clone());
        self.node("Relu", &[&sum.name], vec![], dims)
    }

    fn pool(&mut self, of: &Value) -> Value {
        let two = ints(&[2, 2]);
        let attributes = vec![("kernel_shape", two.clone()), ("strides", two)];
        let dims = vec![of.dims[0], of.dims[1] / 2, of.dims[2] / 2];
        self.node("MaxPool", &[&of.name], attributes, dims)
    }

    fn mean(&mut self, of: &Value) -> Value {
        let n = of.dims[0];
        let mean = self.node("GlobalAveragePool", &[&of.name], vec![], vec![n, 1, 1]);
        self.flat(&mean)
    }

    fn flat(&mut self, of: &Value) -> Value {
        let dims = vec![of.dims.iter().product()];
        self.node(
            "Flatten",
            &[&of.name],
            vec![("axis", Attribute::Int(1))],
            dims,
        )
    }

    fn look(&mut self, of: &Value, places: &Places, deviation: f32) -> Value {
        let [channels, rows, cols] = of.dims[..] else {
            return of.clone();
        };
        let n = places.x.len();
        let x = self.weights(&places.x, (cols, width_of(self.inputs.tile)), deviation);
        let y = self.weights(&places.y, (rows, 1.0), deviation);
        let x = self.reshaped(&x, &[n, 1, cols]);
        let y = self.reshaped(&y, &[n, rows, 1]);
        let both = self.node("Mul", &[&y.name, &x.name], vec![], vec![n, rows, cols]);
        let both = self.reshaped(&both, &[n, rows * cols]);
        let map = self.reshaped(of, &[channels, rows * cols]);
        let turn = vec![("perm", ints(&[0, 2, 1]))];
        let map = self.node("Transpose", &[&map.name], turn, vec![rows * cols, channels]);
        let looked = self.node(
            "MatMul",
            &[&both.name, &map.name],
            vec![],
            vec![n, channels],
        );
        self.reshaped(&looked, &[n * channels])
    }

    fn join(&mut self, of: &[&Value]) -> Value {
        let names: Vec<&str> = of.iter().map(|it| it.name.as_str()).collect();
        let dims = vec![of.iter().map(|it| it.dims[0]).sum()];
        self.node("Concat", &names, vec![("axis", Attribute::Int(1))], dims)
    }

    fn dense(&mut self, of: &Value, name: &str, values: usize) -> Value {
        let [weight, bias] = ["weight", "bias"].map(|it| format!("{name}.{it}"));
        self.constant(&weight);
        self.constant(&bias);
        let attributes = vec![("transB", Attribute::Int(1))];
        self.node(
            "Gemm",
            &[&of.name, &weight, &bias],
            attributes,
            vec![values],
        )
    }

    fn prelu(&mut self, of: &Value, name: &str) -> Value {
        self.constant(name);
        self.node("PRelu", &[&of.name, name], vec![], of.dims.clone())
    }

    fn dropout(&mut self, of: &Value, _: f32) -> Value {
        of.clone()
    }
}
