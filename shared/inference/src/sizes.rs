//! Checks the sizes that are given as constants in a network, because the library would allocate memory of any size.

use std::collections::HashMap;

use rten_onnx::onnx::{AttributeProto, GraphProto, ModelProto, NodeProto, TensorProto};

/// Largest side, padding, stride or repeat.
const LARGEST_SIDE: i64 = 1 << 16;
/// Maximum number of values in a tensor.
const MOST_VALUES: i64 = 1 << 28;
/// Deepest nesting of graphs inside nodes.
const DEEPEST: usize = 8;

/// Attributes that specify sizes.
const ATTRIBUTES: [&str; 10] = [
    "pads",
    "kernel_shape",
    "strides",
    "dilations",
    "output_padding",
    "output_shape",
    "repeats",
    "blocksize",
    "scales",
    "shape",
];
/// Inputs that specify sizes, by operator.
const INPUTS: [(&str, &[usize]); 9] = [
    ("Pad", &[1]),
    ("Resize", &[2, 3]),
    ("Upsample", &[1]),
    ("Expand", &[1]),
    ("Tile", &[1]),
    ("Reshape", &[1]),
    ("ConstantOfShape", &[0]),
    ("OneHot", &[1]),
    ("Range", &[0, 1]),
];

/// Error for a size that is larger than any network needs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("node {node:?} ({op}): {what} {value} exceeds the limit ({most})")]
pub(crate) struct TooLarge {
    node: String,
    op: String,
    what: String,
    value: i64,
    most: i64,
}

/// Checks all nodes of a file. A file that cannot be read is accepted here, because the library reports it later.
pub(crate) fn check(file: &[u8]) -> Result<(), TooLarge> {
    let graph = ModelProto::parse_buf(file).ok().and_then(|model| model.graph);
    graph.map_or(Ok(()), |graph| check_graph(&graph, DEEPEST))
}

fn check_graph(graph: &GraphProto, deep: usize) -> Result<(), TooLarge> {
    let mut constants: HashMap<&str, Vec<i64>> = HashMap::new();
    for tensor in &graph.initializer {
        constants.insert(tensor.name.as_deref().unwrap_or_default(), whole(tensor));
    }
    for node in &graph.node {
        let value = node.attribute.iter().find_map(|attribute| attribute.t.as_ref());
        let ints = node.attribute.iter().find(|attribute| !attribute.ints.is_empty());
        if let ("Constant", Some(name)) = (op(node), node.output.first()) {
            let numbers = value.map(whole).or(ints.map(|int| int.ints.clone()));
            constants.insert(name, numbers.unwrap_or_default());
        }
    }
    for node in &graph.node {
        for attribute in &node.attribute {
            check_attribute(node, attribute)?;
            if let (Some(inner), Some(deeper)) = (&attribute.g, deep.checked_sub(1)) {
                check_graph(inner, deeper)?;
            }
        }
        let inputs = INPUTS.iter().find(|input| input.0 == op(node));
        for input in inputs.map_or(&[][..], |input| input.1) {
            let name = node.input.get(*input).map(String::as_str);
            let values = name.and_then(|name| constants.get(name));
            check_values(
                node,
                &format!("input {input}"),
                values.map_or(&[], Vec::as_slice),
            )?;
        }
    }
    Ok(())
}

fn check_attribute(node: &NodeProto, attribute: &AttributeProto) -> Result<(), TooLarge> {
    let name = attribute.name.as_deref().unwrap_or_default();
    if !ATTRIBUTES.contains(&name) {
        return Ok(());
    }
    let floats = attribute.floats.iter().map(|float| *float as i64);
    let values = attribute.ints.iter().copied().chain(attribute.i);
    let values: Vec<i64> = values.chain(floats).collect();
    check_values(node, &format!("attribute {name:?}"), &values)
}

fn check_values(node: &NodeProto, what: &str, values: &[i64]) -> Result<(), TooLarge> {
    let too_large = |value, most| TooLarge {
        node: node.name.clone().unwrap_or_default(),
        op: op(node).to_owned(),
        what: what.to_owned(),
        value,
        most,
    };
    let side = values.iter().find(|value| value.saturating_abs() > LARGEST_SIDE);
    if let Some(side) = side.filter(|_| op(node) != "Reshape") {
        return Err(too_large(*side, LARGEST_SIDE));
    }
    let sides = values.iter().filter(|value| **value > 0);
    let product = sides.fold(1_i64, |product, side| product.saturating_mul(*side));
    if product > MOST_VALUES {
        return Err(too_large(product, MOST_VALUES));
    }
    Ok(())
}

/// The values of a short tensor, rounded up to integers.
fn whole(tensor: &TensorProto) -> Vec<i64> {
    const FLOAT: i32 = 1;
    let raw = tensor.raw_data.as_ref().map(|raw_value| raw_value.borrow());
    let raw = raw.as_deref().map_or(&[][..], Vec::as_slice);
    if raw.len() > 1024 {
        return Vec::new();
    }
    let floats = tensor.float_data.iter().map(|float_value| float_value.ceil() as i64);
    let stated = tensor.int64_data.iter().copied();
    let stated = stated.chain(tensor.int32_data.iter().map(|int32_value| i64::from(*int32_value)));
    let is_float = tensor.data_type.is_some_and(|data_type| data_type.0 == FLOAT);
    let raw: Vec<i64> = if is_float {
        let values = raw.as_chunks::<4>().0.iter();
        values.map(|value| f32::from_le_bytes(*value).ceil() as i64).collect()
    } else {
        let values = raw.as_chunks::<8>().0.iter();
        values.map(|value| i64::from_le_bytes(*value)).collect()
    };
    stated.chain(floats).chain(raw).take(64).collect()
}

fn op(node: &NodeProto) -> &str {
    node.op_type.as_deref().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use crate::onnx::{Attribute, Network};

    use super::*;

    fn refused(op: &str, constant: Vec<i64>, at: usize) -> String {
        let mut net = Network::default();
        net.ints("sizes", constant);
        let mut inputs = vec!["x"; at];
        inputs.push("sizes");
        net.node(op, &inputs, "y", vec![]);
        check(&net.file()).unwrap_err().to_string()
    }

    #[test]
    fn implausible_sizes_are_refused_with_their_node() {
        let large = 1_000_000_000;
        for (op, at) in [
            ("Pad", 1),
            ("Resize", 3),
            ("Expand", 1),
            ("Tile", 1),
            ("ConstantOfShape", 0),
        ] {
            let error = refused(op, vec![0, large], at);
            assert!(
                error.starts_with(&format!("node \"y\" ({op}): input {at} {large}")),
                "{error}"
            );
        }
        let error = refused("Reshape", vec![1 << 15, 1 << 15], 1);
        assert!(error.contains(&format!("{}", 1_i64 << 30)), "{error}");
        let mut net = Network::default();
        net.node(
            "Conv",
            &["x"],
            "y",
            vec![("pads", Attribute::Ints(vec![large; 4]))],
        );
        let error = check(&net.file()).unwrap_err().to_string();
        assert_eq!(
            error,
            "node \"y\" (Conv): attribute \"pads\" 1000000000 exceeds the limit (65536)"
        );
    }

    #[test]
    fn usual_sizes_pass() {
        let mut net = Network::default();
        net.ints("shape", vec![1, -1, 768]);
        net.ints("ends", vec![i64::MAX]);
        net.node("Reshape", &["x", "shape"], "y", vec![]);
        net.node("Slice", &["y", "ends", "ends"], "z", vec![]);
        net.node(
            "Conv",
            &["z"],
            "o",
            vec![("pads", Attribute::Ints(vec![1; 4]))],
        );
        check(&net.file()).unwrap();
    }
}
