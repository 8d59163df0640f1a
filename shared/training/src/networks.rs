//! Training of networks: one finds joints, one finds people, and one predicts the errors of single views.
//!
//! * [`Network`]: a network, defined once by the operations of [`Ops`]. [`initial`] plans its parameters, [`write()`] writes it as
//!   an ONNX file.
//! * [`Task`]: what is learned, from whom, and how. [`pose`], [`finder`] and [`quality`] are the three.
//! * [`Trainer`]: runs the steps of a task, keeps the best network, and writes everything that it knows as a checkpoint, from which
//!   a training goes on and ends with the same bits.
//! * [`Backend`]: what computes. Rust is built in; `LibTorch` comes with the feature `libtorch`, for a processor with fast cores.
//!
//! Nothing here reads or writes files.

mod begun;
mod checkpoint;
mod compute;
mod lesson;
mod onnx;
mod ops;
mod optimiser;
mod order;
mod parameters;
mod reference;
mod settings;
#[cfg(feature = "libtorch")]
mod torch;
mod training;
mod trunk;

pub mod finder;
pub mod pose;
pub mod quality;

pub use checkpoint::StoreError;
pub use lesson::Shown;
pub use onnx::{Document, write};
pub use ops::{Conv, Dims, Network, Ops, Output, Places, Scaling};
pub use optimiser::{Rule, Step};
pub use parameters::{Parameter, Role, initial};
pub use settings::{Backend, Precision, SettingsError};
pub use training::{Batch, Costed, Kept, Pass, Plan, Task, TrainError, Trainer};
