//! The interface to a library that runs networks.

use core::fmt;

/// Inputs, outputs and metadata of a network, as declared in its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// Names and values of the file's `metadata_props`.
    pub metadata: Vec<(String, String)>,
    /// Inputs of the network.
    pub inputs: Vec<Port>,
    /// Outputs of the network.
    pub outputs: Vec<Port>,
}

/// An input or an output of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Name of the input or output.
    pub name: String,
    /// Sides of the tensor; empty if the file does not declare them.
    pub sides: Vec<Side>,
}

/// A side of a tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Side {
    /// A fixed size.
    Fixed(usize),
    /// Any size, with the name of the dimension.
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

/// Formats the sides of a tensor as text, for example `[n, 3, 256, 192]`.
pub fn written(sides: &[Side]) -> String {
    let words: Vec<String> = sides.iter().map(ToString::to_string).collect();
    format!("[{}]", words.join(", "))
}

/// An input tensor.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// Name of the input.
    pub name: &'a str,
    /// Sizes of the tensor's axes.
    pub shape: &'a [usize],
    /// Values of the tensor, with the last axis fastest.
    pub values: Values<'a>,
}

/// The values of a tensor.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// 32-bit integers.
    I32(&'a [i32]),
    /// Bytes.
    U8(&'a [u8]),
}

/// An output tensor.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Index in the list of requested outputs.
    pub index: usize,
    /// Sizes of the tensor's axes.
    pub shape: &'a [usize],
    /// Values of the tensor, with the last axis fastest; `None` if they are not single precision.
    pub values: Option<&'a [f32]>,
}

/// An error from a library.
pub(crate) type EngineError = Box<dyn std::error::Error + Send + Sync>;

/// Reason why a network could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The library cannot read the file: it is not an ONNX file, is truncated, or has unsupported operations.
    #[error("the file is not a network that Parallax can run")]
    File(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// ONNX Runtime cannot be used.
    #[error("ONNX Runtime cannot be used")]
    Library(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// ONNX Runtime cannot run the network on a GPU.
    #[error("ONNX Runtime cannot use CUDA")]
    Cuda(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// The library could not run the network.
#[derive(Debug, thiserror::Error)]
#[error("the network failed when it was run")]
pub struct RunError(#[source] pub(crate) EngineError);

/// A network loaded by a library.
pub(crate) trait Engine: fmt::Debug + Send + Sync {
    /// Runs the network on one thread of the processor, and passes the outputs with the given names to the caller.
    fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), EngineError>;
}
