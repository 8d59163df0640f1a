//! A network as described in its file: its constants, and its operations with the names of their inputs.

use std::collections::HashMap;

use rten_onnx::onnx::{GraphProto, ModelProto, NodeProto, TensorProto};

const FLOAT: i32 = 1;
const FLOAT16: i32 = 10;
/// Maximum number of casts between a constant and the node that uses it.
const MOST_CASTS: usize = 4;

/// The graph of a file.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) graph: GraphProto,
    /// Input of each cast node by the name of its output.
    casts: HashMap<String, String>,
    constants: HashMap<String, usize>,
}

/// A constant in single precision.
#[derive(Debug)]
pub(crate) struct Constant {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f32>,
}

impl Source {
    /// Reads a file; returns `None` if it cannot be read.
    pub(crate) fn read(file: &[u8]) -> Option<Self> {
        let graph = ModelProto::parse_buf(file).ok()?.graph?;
        let named = graph.initializer.iter().enumerate();
        let constants = named.filter_map(|(at, tensor)| Some((tensor.name.clone()?, at)));
        let casts = graph.node.iter().filter(|node| op(node) == "Cast");
        let casts = casts
            .filter_map(|node| Some((node.output.first()?.clone(), node.input.first()?.clone())));
        Some(Self {
            casts: casts.collect(),
            constants: constants.collect(),
            graph,
        })
    }

    /// A constant stored in single or half precision.
    pub(crate) fn constant(&self, name: &str) -> Option<Constant> {
        let mut name = name;
        for _ in 0..MOST_CASTS {
            if let Some(at) = self.constants.get(name) {
                return constant(&self.graph.initializer[*at]);
            }
            name = self.casts.get(name)?;
        }
        None
    }

    /// Name of the only input, with the channels, rows and columns of one picture; `None` if the network has other inputs.
    pub(crate) fn input(&self) -> Option<(&str, [usize; 3])> {
        let mut inputs = self.graph.input.iter().filter(|input| {
            let name = input.name.as_deref().unwrap_or_default();
            !self.constants.contains_key(name)
        });
        let (Some(input), None) = (inputs.next(), inputs.next()) else {
            return None;
        };
        let tensor = input.r#type.as_ref()?.tensor_type.as_ref()?;
        if tensor.elem_type?.0 != FLOAT {
            return None;
        }
        let sides = tensor.shape.as_ref()?.dim.iter();
        let sides: Vec<Option<i64>> = sides.map(|side| side.dim_value).collect();
        let [None | Some(1), Some(channels), Some(rows), Some(cols)] = sides[..] else {
            return None;
        };
        let sides = [channels, rows, cols].map(|side| usize::try_from(side).unwrap_or_default());
        let holds = sides.iter().all(|side| *side > 0);
        holds.then_some((input.name.as_deref()?, sides))
    }
}

/// The operator of a node.
pub(crate) fn op(node: &NodeProto) -> &str {
    node.op_type.as_deref().unwrap_or_default()
}

/// Integers of an attribute; `None` if the node does not have the attribute.
pub(crate) fn ints<'a>(node: &'a NodeProto, name: &str) -> Option<&'a [i64]> {
    let mut all = node.attribute.iter();
    let found = all.find(|attribute| attribute.name.as_deref() == Some(name))?;
    Some(&found.ints)
}

/// Integer of an attribute.
pub(crate) fn int(node: &NodeProto, name: &str) -> Option<i64> {
    let mut all = node.attribute.iter();
    all.find(|attribute| attribute.name.as_deref() == Some(name))?.i
}

/// Text of an attribute, or `without` if the node does not have the attribute.
pub(crate) fn text<'a>(node: &'a NodeProto, name: &str, without: &'a str) -> &'a str {
    let mut all = node.attribute.iter();
    let found = all.find(|attribute| attribute.name.as_deref() == Some(name));
    found.and_then(|found| found.s.as_deref()).unwrap_or(without)
}

fn constant(tensor: &TensorProto) -> Option<Constant> {
    let sides = tensor.dims.iter().map(|side| usize::try_from(*side).ok());
    let shape: Vec<usize> = sides.collect::<Option<_>>()?;
    let raw = tensor.raw_data.as_ref().map(|raw| raw.borrow());
    let raw = raw.as_deref().map_or(&[][..], Vec::as_slice);
    let kind = tensor.data_type?.0;
    let values: Vec<f32> = match kind {
        FLOAT if raw.is_empty() => tensor.float_data.clone(),
        FLOAT => raw.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
        FLOAT16 => raw
            .as_chunks::<2>()
            .0
            .iter()
            .map(|bytes| crate::onnx::value_of_half(u16::from_le_bytes(*bytes)))
            .collect(),
        _ => return None,
    };
    let n = shape.iter().try_fold(1_usize, |n, side| n.checked_mul(*side))?;
    (n == values.len()).then_some(Constant { shape, values })
}
