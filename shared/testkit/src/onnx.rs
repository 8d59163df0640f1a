//! Writer of small ONNX files: the graph, its weights and what the file says of itself.

/// A side of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// So many.
    Fixed(usize),
    /// Whatever is called so.
    Named(&'static str),
}

/// What an attribute of a node says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Attribute {
    /// A whole number.
    Int(i64),
    /// Several of them.
    Ints(Vec<i64>),
}

/// One operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// What is done.
    pub op: String,
    /// Names of the values that it takes.
    pub inputs: Vec<String>,
    /// Name of the value that it gives.
    pub output: String,
    /// Names and values.
    pub attributes: Vec<(&'static str, Attribute)>,
}

/// Weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// By what name nodes take them.
    pub name: String,
    /// Their shape.
    pub shape: Vec<usize>,
    /// Row major.
    pub values: Vec<f32>,
}

/// A network.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Network {
    /// Names and shapes; all f32.
    pub inputs: Vec<(String, Vec<Side>)>,
    /// The same of what it gives.
    pub outputs: Vec<(String, Vec<Side>)>,
    /// In the order in which they are done.
    pub nodes: Vec<Node>,
    /// Weights.
    pub weights: Vec<Weights>,
    /// Names and values of what it says of itself.
    pub metadata: Vec<(String, String)>,
}

impl Network {
    /// Adds weights.
    ///
    /// # Panics
    ///
    /// Unless there are as many values as the shape asks for.
    pub fn weigh(&mut self, name: &str, shape: &[usize], values: Vec<f32>) {
        assert_eq!(
            values.len(),
            shape.iter().product::<usize>(),
            "as many as the shape asks for"
        );
        let (name, shape) = (name.to_owned(), shape.to_vec());
        self.weights.push(Weights {
            name,
            shape,
            values,
        });
    }

    /// Adds an operation.
    pub fn node(
        &mut self,
        op: &str,
        inputs: &[&str],
        output: &str,
        attributes: Vec<(&'static str, Attribute)>,
    ) {
        self.nodes.push(Node {
            op: op.to_owned(),
            inputs: inputs.iter().map(|it| (*it).to_owned()).collect(),
            output: output.to_owned(),
            attributes,
        });
    }

    /// The file, of operator set 13.
    #[must_use]
    pub fn file(&self) -> Vec<u8> {
        let mut graph = Message::default();
        for it in &self.nodes {
            graph.message(1, &node(it));
        }
        graph.text(2, "test");
        for it in &self.weights {
            graph.message(5, &weights(it));
        }
        for (field, values) in [(11, &self.inputs), (12, &self.outputs)] {
            for (name, shape) in values {
                graph.message(field, &value(name, shape));
            }
        }
        let mut operators = Message::default();
        operators.text(1, "");
        operators.number(2, 13);
        let mut model = Message::default();
        model.number(1, 8);
        model.message(7, &graph);
        model.message(8, &operators);
        for (key, value) in &self.metadata {
            let mut entry = Message::default();
            entry.text(1, key);
            entry.text(2, value);
            model.message(14, &entry);
        }
        model.0
    }
}

fn node(node: &Node) -> Message {
    let mut message = Message::default();
    for it in &node.inputs {
        message.text(1, it);
    }
    message.text(2, &node.output);
    message.text(3, &node.output);
    message.text(4, &node.op);
    for (name, value) in &node.attributes {
        let mut attribute = Message::default();
        attribute.text(1, name);
        match value {
            Attribute::Int(it) => {
                attribute.number(3, *it as u64);
                attribute.number(20, 2);
            }
            Attribute::Ints(all) => {
                for it in all {
                    attribute.number(8, *it as u64);
                }
                attribute.number(20, 7);
            }
        }
        message.message(5, &attribute);
    }
    message
}

fn weights(weights: &Weights) -> Message {
    let mut message = Message::default();
    for it in &weights.shape {
        message.number(1, *it as u64);
    }
    message.number(2, 1); // f32
    message.text(8, &weights.name);
    let bytes: Vec<u8> = weights
        .values
        .iter()
        .flat_map(|it| it.to_le_bytes())
        .collect();
    message.bytes(9, &bytes);
    message
}

fn value(name: &str, shape: &[Side]) -> Message {
    let mut sides = Message::default();
    for it in shape {
        let mut side = Message::default();
        match it {
            Side::Fixed(n) => side.number(1, *n as u64),
            Side::Named(name) => side.text(2, name),
        }
        sides.message(1, &side);
    }
    let mut tensor = Message::default();
    tensor.number(1, 1); // f32
    tensor.message(2, &sides);
    let mut kind = Message::default();
    kind.message(1, &tensor);
    let mut message = Message::default();
    message.text(1, name);
    message.message(2, &kind);
    message
}

/// Takes a `tile` of 4 x 3 pixels:
/// `sigma = means of the three colours x [[1, 2], [10, 20], [100, 200]] + [0.5, 0.25]`.
pub fn of_colours() -> Network {
    let mut net = Network::default();
    let tile = [
        Side::Named("n"),
        Side::Fixed(3),
        Side::Fixed(4),
        Side::Fixed(3),
    ];
    net.inputs.push(("tile".to_owned(), tile.to_vec()));
    net.outputs
        .push(("sigma".to_owned(), vec![Side::Named("n"), Side::Fixed(2)]));
    net.weigh("w", &[3, 2], vec![1.0, 2.0, 10.0, 20.0, 100.0, 200.0]);
    net.weigh("b", &[2], vec![0.5, 0.25]);
    net.node("GlobalAveragePool", &["tile"], "mean", vec![]);
    net.node("Flatten", &["mean"], "flat", vec![]);
    net.node("Gemm", &["flat", "w", "b"], "sigma", vec![]);
    net
}

/// A message of protocol buffers while it is written.
#[derive(Debug, Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn number(&mut self, field: u64, value: u64) {
        self.varint(field << 3);
        self.varint(value);
    }

    fn bytes(&mut self, field: u64, bytes: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }

    fn text(&mut self, field: u64, text: &str) {
        self.bytes(field, text.as_bytes());
    }

    fn message(&mut self, field: u64, message: &Self) {
        self.bytes(field, &message.0);
    }
}
