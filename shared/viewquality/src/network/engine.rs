//! What a library that runs networks has to tell and to do.

use core::fmt;

/// What a file says of the network in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Description {
    /// Names and values of its `metadata_props`.
    pub(super) metadata: Vec<(String, String)>,
    /// What it takes.
    pub(super) inputs: Vec<Port>,
    /// Names of what it gives.
    pub(super) outputs: Vec<String>,
}

/// An input.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Port {
    pub(super) name: String,
    /// Empty where the file does not say.
    pub(super) sides: Vec<Side>,
}

/// A side of a tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Side {
    Fixed(usize),
    /// Of any size; its name.
    Named(String),
}

impl Side {
    /// Whether it may have a size.
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

/// A tensor that goes in.
#[derive(Debug, Clone)]
pub(super) struct Input<'a> {
    pub(super) name: &'static str,
    pub(super) shape: Vec<usize>,
    pub(super) values: &'a [f32],
}

/// A tensor that comes out: its shape and its values.
pub(super) type Output = (Vec<usize>, Vec<f32>);

/// What a library says is wrong.
pub(super) type Wrong = Box<dyn std::error::Error + Send + Sync>;

/// A network in the hands of a library.
pub(super) trait Engine: fmt::Debug + Send + Sync {
    /// Runs it on one thread of the processor.
    ///
    /// * Returns the output of that name, `None` unless it is of `f32`.
    fn run(&self, inputs: &[Input<'_>], output: &str) -> Result<Option<Output>, Wrong>;
}
