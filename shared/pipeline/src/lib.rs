//! The pure processing steps, and complete pipelines that run them in one process.
//!
//! The services run the steps in separate processes. [`NetworkEstimator`] and [`Estimator`] run all steps of one method in sequence. The
//! system tests compare the services with these estimators: the same input gives bit-identical results.
#![forbid(unsafe_code)]

mod bodies;
mod by_keypoints;
mod by_network;
mod colour;
mod disagreement;
mod extras;
mod following;
mod frame_time;
mod fuse_step;
mod fused;
mod fused_view;
mod look_budget;
mod looks;
mod motion;
mod network_memory;
mod network_step;
mod people;
mod person_evidence;
mod person_step;
mod placed;
mod sighting;
mod skeleton_settings;
mod skeleton_step;
mod space;
mod space_settings;
mod space_step;
mod thumbnail;
mod tracks;
mod view_result;
mod view_step;
mod who;

mod estimate;

pub use bodies::{Body, NoJoint};
pub use by_network::{
    NetworkEstimate, NetworkEstimator, NetworkEstimatorSettings, ViewContent, ViewFrame,
};
pub use estimate::{Estimate, Estimator, EstimatorError, EstimatorSettings, plan};
pub use extras::ExtrasStep;
pub use following::{Follow, Following, Others};
pub use frame_time::time_s;
pub use fuse_step::{
    AllViewsHypothesis, AllViewsResult, FuseStep, PairResult, PairTables, Support, Views, all_pairs,
};
pub use fused_view::FusedView;
pub use look_budget::{LookBudget, Spent};
pub use motion::Motion;
pub use network_memory::{LOST, NetworkMemory};
pub use network_step::{Eyes, NetworkSettings, NetworkStep, most_values};
pub use sighting::{Sighting, ViewSightings, parts_of};
pub use skeleton_settings::{BodySettings, Combine, SkeletonSettings};
pub use skeleton_step::{Kept, Skeleton, SkeletonStep};
pub use space_settings::SpaceStepSettings;
pub use space_step::{PersonSkeleton, SpaceStep};
pub use view_result::{ExtraKeypoint, ViewResult};
pub use view_step::{ComputedOn, EvidenceWindow, ViewEstimate, ViewSettings, ViewStep};
pub use who::{FramePeople, KnownPerson, WhoSettings, WhoStep};
