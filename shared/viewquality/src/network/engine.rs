//! The interface of a library that runs networks.

use core::fmt;

/// The interface of a network, as declared in its file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Description {
    /// Names and values of its `metadata_props`.
    pub(super) metadata: Vec<(String, String)>,
    /// Its inputs.
    pub(super) inputs: Vec<InputInfo>,
    /// Names of its outputs.
    pub(super) outputs: Vec<String>,
}

/// An input.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InputInfo {
    pub(super) name: String,
    /// Empty if the file does not declare them.
    pub(super) sides: Vec<Side>,
}

/// A side of a tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Side {
    Fixed(usize),
    /// Any size; the name of the dimension.
    Named(String),
}

impl Side {
    /// Whether it accepts a size.
    pub(super) fn may_be(&self, size: usize) -> bool {
        match self {
            Self::Fixed(n) => *n == size,
            Self::Named(_) => true,
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(n) => write!(to, "{n}"),
            Self::Named(name) if name.is_empty() => to.write_str("?"),
            Self::Named(name) => to.write_str(name),
        }
    }
}

/// An input tensor.
#[derive(Debug, Clone)]
pub(super) struct Input<'a> {
    pub(super) name: &'static str,
    pub(super) shape: Vec<usize>,
    pub(super) values: &'a [f32],
}

/// An output tensor: its shape and its values.
pub(super) type Output = (Vec<usize>, Vec<f32>);

/// An error of the library.
pub(super) type EngineError = Box<dyn std::error::Error + Send + Sync>;

/// A network that is loaded by a library.
pub(super) trait Engine: fmt::Debug + Send + Sync {
    /// Runs it on one thread of the processor.
    ///
    /// * Returns the output with that name, `None` unless it is `f32`.
    fn run(&self, inputs: &[Input<'_>], output: &str) -> Result<Option<Output>, EngineError>;
}
