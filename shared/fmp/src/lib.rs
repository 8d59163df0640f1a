//! Flexible mixtures of parts in one image (Yang & Ramanan 2013; the paper's section 3).
//!
//! Reading order: [`Model`] (what was trained), [`Layout`] (where the cells of the feature pyramid
//! lie in the image), [`Responses`] (what every filter answers at every cell), then the solver,
//! which finds the best tree of parts exactly, and [`Pose`], its answer; [`IncrementalSolver`] solves the same
//! evidence under changing terms with less work. A [`Scope`] is a part of the pyramid that is searched
//! instead of all of it, and [`Tracker`] decides which. Responses are single precision and the same
//! bits on every machine, unless another [`Precision`] is asked for by name.
#![forbid(unsafe_code)]

pub mod files;
pub mod reference;

mod cuts;
mod extract;
mod features;
mod layout;
mod local;
mod model;
mod pool;
mod pose;
mod precision;
mod pyramid;
mod responses;
mod scope;
mod solve;
mod track;

pub use extract::Extractor;
pub use layout::{ImageTooSmall, Layout, LevelLayout};
pub use local::{LocalScore, local_scores};
pub use model::{Edge, Filter, Model, ModelError, ModelSpec, PartSpec, Spring, Springs};
pub use pose::{Placement, Pose};
pub use precision::Precision;
pub use pyramid::FeaturePyramid;
pub use responses::Responses;
pub use scope::{Region, Scope, ScopeError, Window};
pub use solve::{
    Bound, Bounds, CandidateSettings, ExtraTerms, IncrementalSolver, SolveStatistics, Solver,
};
pub use track::{FrameTime, TrackSettings, Tracker};

/// Channels of the features: 18 contrast-sensitive and 9 contrast-insensitive orientations, 4
/// texture energies, 1 that is set in the padding only.
pub const N_CHANNELS: usize = 32;
