//! Networks from ONNX files. They are run by Parallax itself together with the built-in library `rten`, or by ONNX Runtime, which the user
//! provides.
//!
//! A [`Session`] is a loaded network. It has a description of its inputs and outputs ([`Description`]) and runs on one thread
//! ([`Session::run`]). This crate does not interpret the values.
#![forbid(unsafe_code)]

mod direct;
mod engine;
mod front;
mod nesting;
pub mod onnx;
#[cfg(feature = "ort")]
mod onnx_runtime;
mod plan;
mod provider;
mod rest;
mod rten_engine;
mod session;
mod sizes;
mod source;
#[cfg(test)]
mod tests;

pub use engine::{Description, Input, LoadError, Output, Port, RunError, Side, Values, written};
#[cfg(feature = "ort")]
pub use onnx_runtime::OnnxRuntime;
pub use provider::{Place, Provider};
pub use session::{RunBy, Session};
