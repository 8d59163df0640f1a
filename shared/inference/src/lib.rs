//! Networks from ONNX files, run by the `rten` library, which is built in, or by ONNX Runtime, which the user provides.
//!
//! A [`Session`] is a network that is loaded: what it takes and gives ([`Description`]), and how it is run
//! ([`Session::run`]), on one thread. What its numbers mean is for others to say.
#![forbid(unsafe_code)]

mod engine;
mod nesting;
#[cfg(feature = "ort")]
mod onnx_runtime;
mod rten_engine;
mod session;
mod sizes;

pub use engine::{Description, Input, LoadError, Output, Port, RunError, Side, Values, written};
#[cfg(feature = "ort")]
pub use onnx_runtime::OnnxRuntime;
pub use session::Session;
