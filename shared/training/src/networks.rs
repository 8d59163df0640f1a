//! Training of networks: one finds joints, one finds people, and one predicts the errors of single views.
//!
//! * [`Network`]: a network, defined once by the operations of [`Ops`]. [`initial`] creates its parameters, and [`write()`] writes it as an
//!   ONNX file.
//! * [`Task`]: the training data, the cost and the settings of a training run. [`pose`], [`finder`] and [`quality`] are the three tasks.
//! * [`Trainer`]: runs the steps of a task and keeps the best network. It writes its state as a checkpoint. A training run that is resumed
//!   from a checkpoint gives the same network, bit for bit.
//! * [`Backend`]: the library that computes. Rust is built in; `LibTorch` comes with the feature `libtorch`, for a processor with fast
//!   cores.
//!
//! This module does not read or write files.

mod begun;
mod checkpoint;
mod compute;
mod course;
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

pub use begun::BeginError;
pub use checkpoint::StoreError;
pub use course::{About, TooFew};
pub use lesson::Shown;
pub use onnx::{Document, write};
pub use ops::{Conv, Dims, Network, Ops, Output, Places, Scaling};
pub use optimiser::{Rule, Step};
pub use parameters::{Parameter, Role, initial};
pub use settings::{Backend, Precision, SettingsError};
pub use training::{Batch, Costed, Kept, Pass, Plan, Task, TrainError, Trainer};
