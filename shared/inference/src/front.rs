//! The front of a network: the convolutions, the sums and the operations between them that follow the input. Another library runs the rest
//! of the network, and the whole of any network with an unsupported convolution.

use std::collections::{HashMap, HashSet};

use kernels::{Conv, ConvSize, ConvSizeError};
use rten_onnx::onnx::NodeProto;

use crate::source::{Source, int, ints, op, text};

/// Maximum number of values in a stack of channels, including padding.
const MOST_VALUES: usize = 1 << 26;
/// Widest padding.
const MOST_PADDING: usize = 8;
/// Largest side of a kernel.
const MOST_TAPS: usize = 2 * MOST_PADDING + 1;

/// Reason why Parallax itself cannot run the first part of a network.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoFront {
    #[error("the processor has neither AVX2 nor AVX-512")]
    Machine,
    #[error("the input of the network is not a single picture of fixed size")]
    Input,
    #[error("the network has no convolution")]
    Nothing,
    #[error("node {name:?} ({op}): {what}")]
    Node {
        name: String,
        op: String,
        what: &'static str,
    },
    #[error("the layers after the convolutions cannot be run: {0}")]
    Rest(String),
}

/// A value of the front.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Value {
    /// Index of the operation that produces the stack of channels; 0 is the input.
    pub(crate) stack: usize,
    /// True if negative values are replaced with zero.
    pub(crate) is_relu: bool,
    /// Factor by which each pixel is repeated, down and across.
    repeat: usize,
}

/// An operation that produces a stack of channels.
#[derive(Debug)]
pub(crate) enum Operation {
    /// The input of the network.
    Input,
    /// An operation that was merged into a later one.
    Nothing,
    /// A convolution, with an optional value that is added to its result.
    Conv {
        conv: Conv,
        input: Value,
        residual: Option<Value>,
    },
    /// A sum of two values. The pixels of the second value are repeated `repeat` times, down and across.
    Sum { of: [Value; 2], repeat: usize },
}

impl Operation {
    pub(crate) fn takes(&self) -> Vec<Value> {
        match self {
            Self::Input | Self::Nothing => Vec::new(),
            Self::Conv {
                input, residual, ..
            } => [*input].into_iter().chain(*residual).collect(),
            Self::Sum { of, .. } => of.to_vec(),
        }
    }
}

/// A named value of the front that nodes after the front need.
#[derive(Debug)]
pub(crate) struct Exit {
    pub(crate) name: String,
    pub(crate) value: Value,
}

/// The operations of a front, and their results.
#[derive(Debug)]
pub(crate) struct Front {
    pub(crate) operations: Vec<Operation>,
    /// Channels, rows and columns of the result of each operation.
    pub(crate) sides: Vec<[usize; 3]>,
    pub(crate) exits: Vec<Exit>,
    /// Indices of the nodes after the front.
    pub(crate) behind: HashSet<usize>,
    /// Largest padding of any convolution, in rows or columns.
    pub(crate) border: usize,
}

/// State while a front is being found.
struct Finding<'a> {
    source: &'a Source,
    front: Front,
    values: HashMap<&'a str, Value>,
    /// Reasons why nodes are not part of the front.
    refused: HashMap<usize, &'static str>,
}

impl Front {
    /// Finds the front of a network.
    pub(crate) fn find(source: &Source) -> Result<Self, NoFront> {
        let (name, sides) = source.input().filter(|input| fits(input.1)).ok_or(NoFront::Input)?;
        let input = Value {
            stack: 0,
            is_relu: false,
            repeat: 1,
        };
        let mut finding = Finding {
            source,
            front: Self {
                operations: vec![Operation::Input],
                sides: vec![sides],
                exits: Vec::new(),
                behind: HashSet::new(),
                border: 0,
            },
            values: HashMap::from([(name, input)]),
            refused: HashMap::new(),
        };
        for (at, node) in source.graph.node.iter().enumerate() {
            match finding.read(node) {
                Ok(value) => {
                    if let (Some(value), Some(name)) = (value, node.output.first()) {
                        finding.values.insert(name, value);
                    }
                }
                Err(what) => {
                    finding.refused.insert(at, what);
                }
            }
        }
        finding.look_behind()?;
        let mut front = finding.front;
        front.fuse();
        let is_conv = |operation: &Operation| matches!(operation, Operation::Conv { .. });
        if front.operations.iter().any(is_conv) {
            Ok(front)
        } else {
            Err(NoFront::Nothing)
        }
    }

    /// Merges each sum into a convolution that is one of its inputs, if no other operation uses the result of that convolution.
    fn fuse(&mut self) {
        let mut uses = vec![0_usize; self.operations.len()];
        let taken = self.operations.iter().flat_map(Operation::takes);
        for value in taken.chain(self.exits.iter().map(|exit| exit.value)) {
            uses[value.stack] += 1;
        }
        for at in 0..self.operations.len() {
            let Operation::Sum { of, repeat: 1 } = self.operations[at] else {
                continue;
            };
            for [value, other] in [[of[1], of[0]], of] {
                let conv = &mut self.operations[value.stack];
                let is_free = matches!(conv, Operation::Conv { residual: None, .. });
                if is_free && !value.is_relu && uses[value.stack] == 1 {
                    let mut fused = core::mem::replace(conv, Operation::Nothing);
                    if let Operation::Conv { residual, .. } = &mut fused {
                        *residual = Some(other);
                    }
                    self.operations[at] = fused;
                    break;
                }
            }
        }
    }
}

impl<'a> Finding<'a> {
    /// Returns the value that a node produces, or `None` if its input does not come from the front. Fails if the node is not part of the
    /// front.
    fn read(&mut self, node: &'a NodeProto) -> Result<Option<Value>, &'static str> {
        let taken = |at: usize| node.input.get(at).map_or("", String::as_str);
        let Some(&first) = self.values.get(taken(0)) else {
            return Ok(None);
        };
        let is_standard = node.domain.as_deref().is_none_or(str::is_empty);
        match op(node) {
            _ if !is_standard || node.output.len() != 1 => Err("this operation is not supported"),
            "Conv" if first.repeat == 1 => self.conv(node, first).map(Some),
            "Relu" if first.stack > 0 && first.repeat == 1 => Ok(Some(Value {
                is_relu: true,
                ..first
            })),
            "Resize" if first.stack > 0 && first.repeat == 1 => {
                let repeat = self.repeat(node, taken(2))?;
                Ok(Some(Value { repeat, ..first }))
            }
            "Add" => match self.values.get(taken(1)) {
                Some(&second) => self.sum([first, second]).map(Some),
                None => Err("the second input of the layer is not supported"),
            },
            _ => Err("this operation is not supported"),
        }
    }

    fn give(&mut self, operation: Operation, sides: [usize; 3]) -> Result<Value, &'static str> {
        if !fits(sides) {
            return Err("the output of the layer is empty or too large");
        }
        self.front.operations.push(operation);
        self.front.sides.push(sides);
        Ok(Value {
            stack: self.front.sides.len() - 1,
            is_relu: false,
            repeat: 1,
        })
    }

    fn conv(&mut self, node: &NodeProto, input: Value) -> Result<Value, &'static str> {
        let name = node.input.get(1).map_or("", String::as_str);
        let weights = self.source.constant(name);
        let weights = weights
            .ok_or("the weights of the layer are not constants of single or half precision")?;
        let &[outputs, inputs, down, across] = &weights.shape[..] else {
            return Err("the convolution is not two-dimensional");
        };
        let bias = match node.input.get(2).filter(|name| !name.is_empty()) {
            Some(name) => self.source.constant(name).map(|bias| bias.values),
            None => Some(vec![0.0; outputs]),
        };
        let kernel = ints(node, "kernel_shape").is_none_or(|sides| {
            sides.iter().map(|side| usize::try_from(*side)).eq([Ok(down), Ok(across)])
        });
        let is_dilated = ints(node, "dilations").is_some_and(|all| all.iter().any(|n| *n != 1));
        if int(node, "group").unwrap_or(1) != 1 {
            return Err("convolutions in groups are not supported");
        }
        if text(node, "auto_pad", "NOTSET") != "NOTSET" || is_dilated || !kernel {
            return Err("the padding mode, dilation or kernel of the layer is not supported");
        }
        let stride = sides(ints(node, "strides").unwrap_or(&[1, 1]));
        let pads = sides(ints(node, "pads").unwrap_or(&[0; 4]));
        let (Some(stride), Some([top, left, bottom, right])) = (stride, pads) else {
            return Err("the strides or padding of the layer are not supported");
        };
        let most = top.max(left).max(bottom).max(right);
        let [channels, rows, cols] = self.front.sides[input.stack];
        let reach = [rows + top + bottom, cols + left + right];
        let most_taps = down.max(across);
        if most > MOST_PADDING || most_taps > MOST_TAPS {
            return Err("the padding or kernel of the layer is too large");
        }
        if channels != inputs || reach[0] < down || reach[1] < across {
            return Err("the shape of the layer does not match its input");
        }
        let size = ConvSize {
            inputs,
            outputs,
            kernel: [down, across],
            stride,
            pad: [top, left],
        };
        let bias = bias.ok_or("the bias of the layer is not a constant")?;
        let out = [0, 1].map(|axis| (reach[axis] - size.kernel[axis]) / stride[axis] + 1);
        let conv = packed(size, (&weights.values, &bias), input.stack == 0, out);
        let conv = conv.map_err(|_error| "the weights of the layer do not match its shape")?;
        self.front.border = self.front.border.max(most);
        let operation = Operation::Conv {
            conv,
            input,
            residual: None,
        };
        self.give(operation, [outputs, out[0], out[1]])
    }

    /// Number of times that a `Resize` repeats pixels, down and across.
    fn repeat(&self, node: &NodeProto, scales: &str) -> Result<usize, &'static str> {
        let place = text(node, "coordinate_transformation_mode", "half_pixel");
        let nearest = text(node, "nearest_mode", "round_prefer_floor");
        let is_known = matches!(
            (place, nearest),
            ("half_pixel", "round_prefer_floor") | ("asymmetric", "floor")
        );
        let scales = self.source.constant(scales);
        let scales = scales.ok_or("the scales of the layer are not constants")?.values;
        let [1.0, 1.0, down, across] = scales[..] else {
            return Err("the layer scales more than rows and columns");
        };
        let is_whole = down == across && down.fract() == 0.0 && (1.0..=64.0).contains(&down);
        let has_sizes = node.input.get(3).is_some_and(|name| !name.is_empty());
        let has_axes = ints(node, "axes").is_some();
        let is_nearest = text(node, "mode", "nearest") == "nearest" && is_known;
        if is_whole && is_nearest && !has_sizes && !has_axes {
            Ok(down as usize)
        } else {
            Err("the layer enlarges pictures by a method other than repeating pixels")
        }
    }

    fn sum(&mut self, of: [Value; 2]) -> Result<Value, &'static str> {
        let of = if of[0].repeat == 1 {
            of
        } else {
            [of[1], of[0]]
        };
        let repeat = of[1].repeat;
        let [sides, [channels, rows, cols]] = of.map(|value| self.front.sides[value.stack]);
        let fits = of[0].repeat == 1 && sides == [channels, rows * repeat, cols * repeat];
        if of[0].stack == 0 || of[1].stack == 0 || !fits {
            return Err("the inputs of the layer differ in shape");
        }
        self.give(Operation::Sum { of, repeat }, sides)
    }

    /// Follows the outputs back to the values of the front.
    fn look_behind(&mut self) -> Result<(), NoFront> {
        let nodes = &self.source.graph.node;
        let mut makers: HashMap<&str, usize> = HashMap::new();
        for (at, node) in nodes.iter().enumerate() {
            makers.extend(node.output.iter().map(|name| (name.as_str(), at)));
        }
        let outputs = self.source.graph.output.iter();
        let mut open: Vec<&str> = outputs.filter_map(|output| output.name.as_deref()).collect();
        let mut seen = HashSet::new();
        while let Some(name) = open.pop() {
            if !seen.insert(name) {
                continue;
            }
            let value = self.values.get(name);
            if let Some(&value) = value.filter(|value| value.stack > 0 && value.repeat == 1) {
                let name = name.to_owned();
                self.front.exits.push(Exit { name, value });
                continue;
            }
            let Some(&at) = makers.get(name) else {
                continue;
            };
            let node = &nodes[at];
            let has_graph = node.attribute.iter().any(|attribute| attribute.g.is_some());
            if op(node) == "Conv" || has_graph {
                return Err(self.refused(at, node));
            }
            self.front.behind.insert(at);
            open.extend(node.input.iter().map(String::as_str));
        }
        self.front.exits.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(())
    }

    /// Returns an error that names the node, or the first unsupported node on the way to it.
    fn refused(&self, at: usize, node: &NodeProto) -> NoFront {
        let first = self.refused.iter().filter(|(refused, _)| **refused <= at);
        let first = first.min_by_key(|(refused, _)| **refused);
        let nodes = &self.source.graph.node;
        let (node, what) = first.map_or(
            (
                node,
                "the layer is not connected to the input of the network",
            ),
            |(at, what)| (&nodes[*at], *what),
        );
        NoFront::Node {
            name: node.output.first().cloned().unwrap_or_default(),
            op: op(node).to_owned(),
            what,
        }
    }
}

/// Minimum number of input and output channels at which a convolution in tiles is faster than a direct one.
const FEWEST_CHANNELS: usize = 32;
/// Minimum number of outputs per channel at which a convolution in tiles is faster. With fewer outputs, reading the transformed weights
/// takes longer than the products.
const FEWEST_OUTPUTS: usize = 64;

/// Packs the weights and biases of a convolution for the faster method.
///
/// * `is_picture`: true for a convolution of the network's input.
/// * `out`: rows and columns of the output.
fn packed(
    size: ConvSize,
    (weights, bias): (&[f32], &[f32]),
    is_picture: bool,
    out: [usize; 2],
) -> Result<Conv, ConvSizeError> {
    let in_tiles = if !is_picture && is_large(size, out) {
        Conv::in_tiles(size, weights, bias)?
    } else {
        None
    };
    in_tiles.map_or_else(|| Conv::new(size, weights, bias, is_picture), Ok)
}

/// Returns true if a convolution is so large that tiles make it faster.
fn is_large(size: ConvSize, [rows, cols]: [usize; 2]) -> bool {
    size.inputs.min(size.outputs) >= FEWEST_CHANNELS && rows * cols >= FEWEST_OUTPUTS
}

/// Returns true if a stack of channels is within the limit of memory.
fn fits([channels, rows, cols]: [usize; 3]) -> bool {
    let padded = [channels.div_ceil(16), rows, cols].map(|side| side.saturating_add(16));
    let n = padded.into_iter().fold(1_usize, usize::saturating_mul);
    n <= MOST_VALUES / 16 && ![channels, rows, cols].contains(&0)
}

/// Returns exactly `N` non-negative integers.
fn sides<const N: usize>(values: &[i64]) -> Option<[usize; N]> {
    let values = values.iter().map(|value| usize::try_from(*value));
    let values: Vec<usize> = values.collect::<Result<_, _>>().ok()?;
    values.try_into().ok()
}
