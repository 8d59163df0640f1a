//! The interface of a library that runs networks.

use core::fmt;

/// The interface of a network, as declared in its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// Names and values of its `metadata_props`.
    pub metadata: Vec<(String, String)>,
    /// Its inputs.
    pub inputs: Vec<Port>,
    /// Its outputs.
    pub outputs: Vec<Port>,
}

/// An input or an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Its name.
    pub name: String,
    /// Its sides; empty if the file does not declare them.
    pub sides: Vec<Side>,
}

/// A side of a tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Side {
    /// A fixed size.
    Fixed(usize),
    /// Any size; the name of the dimension.
    Named(String),
}

impl Side {
    /// Returns true if the side accepts a size.
    pub fn may_be(&self, size: usize) -> bool {
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

/// The sides of a tensor as text, for example `[n, 3, 256, 192]`.
pub fn written(sides: &[Side]) -> String {
    let words: Vec<String> = sides.iter().map(ToString::to_string).collect();
    format!("[{}]", words.join(", "))
}

/// An input tensor.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its sides.
    pub shape: &'a [usize],
    /// Its values, the last axis fastest.
    pub values: Values<'a>,
}

/// The values of a tensor.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Whole numbers of 32 bits.
    I32(&'a [i32]),
    /// Bytes.
    U8(&'a [u8]),
}

/// An output tensor.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Its place in the list of outputs that were asked for.
    pub index: usize,
    /// Its sides.
    pub shape: &'a [usize],
    /// Its values, the last axis fastest; `None` if they are not of single precision.
    pub values: Option<&'a [f32]>,
}

/// An error of a library.
pub(crate) type EngineError = Box<dyn std::error::Error + Send + Sync>;

/// Why a network could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The library cannot read it: not an ONNX file, truncated, or with unsupported operations.
    #[error("the file is not a network that can be run")]
    File(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The library that should run it cannot be used.
    #[error("ONNX Runtime cannot be used")]
    Library(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// ONNX Runtime cannot run it on a GPU.
    #[error("ONNX Runtime cannot use CUDA")]
    Cuda(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// The library could not run the network.
#[derive(Debug, thiserror::Error)]
#[error("the network cannot be run")]
pub struct RunError(#[source] pub(crate) EngineError);

/// A network that is loaded by a library.
pub(crate) trait Engine: fmt::Debug + Send + Sync {
    /// Runs it on one thread of the processor, and hands over the outputs with these names.
    fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), EngineError>;
}
