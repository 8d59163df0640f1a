//! Trains flexible mixtures of parts from people whose joints are marked (Yang & Ramanan 2013), and [`networks`].
//!
//! Reading order: a [`Plan`] is computed from the annotations alone (sizes, types of parts). A [`Trainer`] runs the [`Step`]s: initial
//! filters, placing people, mining hard examples, and solving the structural support vector machine ([`Machine`]). Images come from an
//! [`Album`], and progress is reported to a [`Watch`]. Between any two steps, the state can be saved as a [`Checkpoint`].
#![forbid(unsafe_code)]

mod album;
mod confuse;
pub mod datasets;
mod dual;
mod example;
mod filters;
mod latent;
mod mine;
pub mod networks;
mod origin;
mod plan;
mod scale;
mod settings;
mod shape;
mod sparse;
mod symmetry;
#[cfg(test)]
mod testing;
mod trainer;
mod types;
mod watch;

pub use album::{Album, AlbumError};
pub use dual::{Constraint, Cost, Effort, Gap, Machine};
pub use plan::{Plan, PlanError, Tree};
pub use settings::{Settings, SettingsError, TypesBy};
pub use shape::{MIN_STIFFNESS, Shape};
pub use sparse::{Run, Sparse};
pub use trainer::{Checkpoint, CheckpointBytesError, CheckpointError, TrainError, Trainer};
pub use watch::{Event, Step, Watch};
