//! Flexible mixtures of parts in one image (Yang & Ramanan 2013; the paper's section 3).
//!
//! Reading order: [`Model`], the trained model; [`Layout`], the positions of the cells of the
//! feature pyramid in the image; [`Responses`], the score of every filter at every cell;
//! [`Solver`], which finds the best tree of parts exactly; and [`Pose`], its result. An
//! [`IncrementalSolver`] solves the same evidence under changing terms with less work. A [`Scope`]
//! restricts the search to a part of the pyramid, and a [`Tracker`] chooses this part. Responses are
//! in single precision and bit-identical on every machine.
#![forbid(unsafe_code)]

pub mod files;
pub mod reference;

mod bounds;
mod cuts;
mod extract;
mod features;
mod layout;
mod local;
mod model;
mod pool;
mod pose;
mod pyramid;
mod responses;
mod scope;
mod search;
mod solve;
mod source;
mod track;

pub use bounds::{Bound, Bounds};
pub use extract::Extractor;
pub use layout::{ImageTooSmall, Layout, LevelLayout, Placement};
pub use local::{LocalScore, local_scores};
pub use model::{Edge, Filter, Model, ModelError, ModelSpec, PartSpec, Spring, Springs};
pub use pose::Pose;
pub use pyramid::FeaturePyramid;
pub use responses::Responses;
pub use scope::{Region, Scope, ScopeError, Window};
pub use search::Search;
pub use solve::{CandidateSettings, ExtraTerms, IncrementalSolver, Root, SolveStatistics, Solver};
pub use track::{FrameTime, TrackSettings, Tracker};

/// Number of feature channels: 18 contrast-sensitive and 9 contrast-insensitive orientations, 4
/// texture energies, and 1 that is set only in the padding.
pub const N_CHANNELS: usize = 32;
