//! Writer of ONNX files: converts a network to the bytes of a file.
//!
//! Field numbers are those of the published schema `onnx.proto`, intermediate representation 8.

mod half;
mod message;

pub use half::value_of as value_of_half;
pub use message::Message;

const IR_VERSION: i64 = 8;
const FLOAT: i64 = 1;
const INT64: i64 = 7;
const FLOAT16: i64 = 10;

/// One side of the shape of an input or output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// A known length.
    Fixed(usize),
    /// Any length, with a name.
    Named(&'static str),
}

/// The value of an attribute of a node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Attribute {
    /// An integer.
    Int(i64),
    /// Several integers.
    Ints(Vec<i64>),
}

/// One operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// The operator, as ONNX calls it.
    pub op: String,
    /// Names of the input values.
    pub inputs: Vec<String>,
    /// Name of the output value, and of the node.
    pub output: String,
    /// Names and values of the attributes.
    pub attributes: Vec<(&'static str, Attribute)>,
}

/// The numbers of a constant, in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Single precision.
    F32(Vec<f32>),
    /// Half precision, as bits.
    F16(Vec<u16>),
    /// Integers, for shapes and indices.
    I64(Vec<i64>),
}

/// A constant: weights, or a list of integers for nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Name by which nodes refer to the constant.
    pub name: String,
    /// Shape of the constant.
    pub shape: Vec<usize>,
    /// Values. Their number must match the shape.
    pub values: Values,
}

/// A network that is built node by node.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Name of the graph.
    pub name: String,
    /// Version of the operators.
    pub operator_set: u32,
    /// Name and version of the program that writes the file.
    pub producer: Option<(String, String)>,
    /// Names and shapes of the inputs, in single precision.
    pub inputs: Vec<(String, Vec<Side>)>,
    /// Names and shapes of the outputs, in single precision.
    pub outputs: Vec<(String, Vec<Side>)>,
    /// Nodes, in an order in which they can be computed.
    pub nodes: Vec<Node>,
    /// Constants of the network.
    pub constants: Vec<Constant>,
    /// Keys and values of `metadata_props`.
    pub metadata: Vec<(String, String)>,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            name: "network".to_owned(),
            operator_set: 17,
            producer: None,
            inputs: Vec::new(),
            outputs: Vec::new(),
            nodes: Vec::new(),
            constants: Vec::new(),
            metadata: Vec::new(),
        }
    }
}

impl Network {
    /// Adds a constant in single precision.
    ///
    /// # Panics
    ///
    /// Panics if the number of values does not match the shape.
    pub fn floats(&mut self, name: &str, shape: &[usize], values: Vec<f32>) {
        let n: usize = shape.iter().product();
        assert_eq!(
            values.len(),
            n,
            "{name}: the number of values must match the shape"
        );
        self.constants.push(Constant {
            name: name.to_owned(),
            shape: shape.to_vec(),
            values: Values::F32(values),
        });
    }

    /// Adds a constant that is stored in half precision and converted to single precision when the file is loaded.
    ///
    /// # Panics
    ///
    /// Panics if the number of values does not match the shape.
    pub fn halves(&mut self, name: &str, shape: &[usize], values: &[f32]) {
        let n: usize = shape.iter().product();
        assert_eq!(
            values.len(),
            n,
            "{name}: the number of values must match the shape"
        );
        let stored = format!("{name}.half");
        self.constants.push(Constant {
            name: stored.clone(),
            shape: shape.to_vec(),
            values: Values::F16(values.iter().map(|value| half::bits_of(*value)).collect()),
        });
        self.node(
            "Cast",
            &[&stored],
            name,
            vec![("to", Attribute::Int(FLOAT))],
        );
    }

    /// Adds a list of constant integers.
    pub fn ints(&mut self, name: &str, values: Vec<i64>) {
        self.constants.push(Constant {
            name: name.to_owned(),
            shape: vec![values.len()],
            values: Values::I64(values),
        });
    }

    /// Adds an operation with one output.
    pub fn node(
        &mut self,
        op: &str,
        inputs: &[&str],
        output: &str,
        attributes: Vec<(&'static str, Attribute)>,
    ) {
        self.nodes.push(Node {
            op: op.to_owned(),
            inputs: inputs.iter().map(|&input| input.to_owned()).collect(),
            output: output.to_owned(),
            attributes,
        });
    }

    /// The bytes of the file.
    #[must_use]
    pub fn file(&self) -> Vec<u8> {
        let graph = Message::default()
            .each(&self.nodes, |graph, it| graph.message(1, &node(it)))
            .text(2, &self.name)
            .each(&self.constants, |graph, it| graph.message(5, &constant(it)))
            .each(&self.inputs, |graph, it| graph.message(11, &value(it)))
            .each(&self.outputs, |graph, it| graph.message(12, &value(it)));
        let operators = Message::default().text(1, "").number(2, self.operator_set.into());
        Message::default()
            .number(1, IR_VERSION)
            .each(&self.producer, |model, (name, version)| {
                model.text(2, name).text(3, version)
            })
            .message(7, &graph)
            .message(8, &operators)
            .each(&self.metadata, |model, (key, value)| {
                model.message(14, &Message::default().text(1, key).text(2, value))
            })
            .finish()
    }
}

fn node(node: &Node) -> Message {
    Message::default()
        .each(&node.inputs, |message, input| message.text(1, input))
        .text(2, &node.output)
        .text(3, &node.output)
        .text(4, &node.op)
        .each(&node.attributes, |message, (name, value)| {
            message.message(5, &attribute(name, value))
        })
}

fn attribute(name: &str, value: &Attribute) -> Message {
    let named = Message::default().text(1, name);
    match value {
        Attribute::Int(value) => named.number(3, *value).number(20, 2),
        Attribute::Ints(all) => {
            named.each(all, |message, value| message.number(8, *value)).number(20, 7)
        }
    }
}

fn constant(constant: &Constant) -> Message {
    let (kind, bytes): (i64, Vec<u8>) = match &constant.values {
        Values::F32(all) => (
            FLOAT,
            all.iter().flat_map(|value| value.to_le_bytes()).collect(),
        ),
        Values::F16(all) => (
            FLOAT16,
            all.iter().flat_map(|value| value.to_le_bytes()).collect(),
        ),
        Values::I64(all) => (
            INT64,
            all.iter().flat_map(|value| value.to_le_bytes()).collect(),
        ),
    };
    Message::default()
        .each(&constant.shape, |message, side| {
            message.number(1, *side as i64)
        })
        .number(2, kind)
        .text(8, &constant.name)
        .bytes(9, &bytes)
}

/// An input or output.
fn value((name, sides): &(String, Vec<Side>)) -> Message {
    let side = |side: &Side| match *side {
        Side::Fixed(length) => Message::default().number(1, length as i64),
        Side::Named(name) => Message::default().text(2, name),
    };
    let shape = Message::default().each(sides, |shape, it| shape.message(1, &side(it)));
    let tensor = Message::default().number(1, FLOAT).message(2, &shape);
    let kind = Message::default().message(1, &tensor);
    Message::default().text(1, name).message(2, &kind)
}
