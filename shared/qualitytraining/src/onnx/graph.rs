//! An ONNX file, put together node by node.
//!
//! Numbers of fields: `onnx.proto` of the published schema, intermediate representation 8, operator set 17.

use super::wire::Message;

const IR_VERSION: i64 = 8;
const OPSET: i64 = 17;
const FLOAT: i64 = 1;
const INT64: i64 = 7;

/// What an attribute of a node is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Attribute<'a> {
    /// A whole number.
    Int(i64),
    /// Several.
    Ints(&'a [usize]),
}

/// A graph that is being written.
#[derive(Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Message>,
    initializers: Vec<Message>,
    inputs: Vec<Message>,
    outputs: Vec<Message>,
}

impl Graph {
    /// Adds an input `[n, dims...]` of single-precision numbers; `None` is a size that is not fixed.
    pub(super) fn input(&mut self, name: &str, dims: &[usize]) {
        self.inputs.push(value(name, dims));
    }

    /// Adds an output `[n, dims...]` of single-precision numbers.
    pub(super) fn output(&mut self, name: &str, dims: &[usize]) {
        self.outputs.push(value(name, dims));
    }

    /// Adds constant numbers.
    pub(super) fn floats(&mut self, name: &str, dims: &[usize], values: &[f32]) {
        let raw: Vec<u8> = values.iter().flat_map(|it| it.to_le_bytes()).collect();
        self.initializers.push(tensor(name, dims, FLOAT, &raw));
    }

    /// Adds a list of constant whole numbers.
    pub(super) fn ints(&mut self, name: &str, values: &[i64]) {
        let raw: Vec<u8> = values.iter().flat_map(|it| it.to_le_bytes()).collect();
        self.initializers
            .push(tensor(name, &[values.len()], INT64, &raw));
    }

    /// Adds a node that gives one value, which is called as the node is.
    pub(super) fn node(
        &mut self,
        operator: &str,
        name: &str,
        inputs: &[&str],
        attributes: &[(&str, Attribute<'_>)],
    ) {
        let node = Message::default()
            .each(inputs, |it, input| it.text(1, input))
            .text(2, name)
            .text(3, name)
            .text(4, operator)
            .each(attributes, |it, (name, of)| {
                it.message(5, &attribute(name, *of))
            });
        self.nodes.push(node);
    }

    /// The bytes of the file.
    ///
    /// * `metadata`: keys and values of `metadata_props`.
    pub(super) fn finish(self, name: &str, metadata: &[(String, String)]) -> Vec<u8> {
        let graph = Message::default()
            .each(&self.nodes, |it, node| it.message(1, node))
            .text(2, name)
            .each(&self.initializers, |it, tensor| it.message(5, tensor))
            .each(&self.inputs, |it, value| it.message(11, value))
            .each(&self.outputs, |it, value| it.message(12, value));
        let opset = Message::default().text(1, "").number(2, OPSET);
        Message::default()
            .number(1, IR_VERSION)
            .text(2, "parallax")
            .text(3, env!("CARGO_PKG_VERSION"))
            .message(7, &graph)
            .message(8, &opset)
            .each(metadata, |it, (key, value)| {
                it.message(14, &Message::default().text(1, key).text(2, value))
            })
            .finish()
    }
}

fn attribute(name: &str, of: Attribute<'_>) -> Message {
    let named = Message::default().text(1, name);
    match of {
        Attribute::Int(it) => named.number(3, it).number(20, 2),
        Attribute::Ints(all) => named
            .each(all, |it, value| it.number(8, *value as i64))
            .number(20, 7),
    }
}

fn tensor(name: &str, dims: &[usize], kind: i64, raw: &[u8]) -> Message {
    Message::default()
        .each(dims, |it, dim| it.number(1, *dim as i64))
        .number(2, kind)
        .text(8, name)
        .bytes(9, raw)
}

/// A value of a size that is known but for that of the batch, `n`.
fn value(name: &str, dims: &[usize]) -> Message {
    let batch = Message::default().text(2, "n");
    let shape = dims
        .iter()
        .fold(Message::default().message(1, &batch), |it, dim| {
            it.message(1, &Message::default().number(1, *dim as i64))
        });
    let tensor = Message::default().number(1, FLOAT).message(2, &shape);
    let kind = Message::default().message(1, &tensor);
    Message::default().text(1, name).message(2, &kind)
}
