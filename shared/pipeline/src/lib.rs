//! The pure processing steps, and all of them in one process.
//!
//! The services call the steps one by one. [`Estimator`] runs them in sequence; the system tests
//! compare the processes with it: the same input gives the same bits.
#![forbid(unsafe_code)]

mod fuse_step;
mod fused;
mod skeleton_step;
mod view_step;

mod estimate;

pub use estimate::{Estimate, Estimator, EstimatorError, EstimatorSettings, plan};
pub use fuse_step::{
    AllViewsHypothesis, AllViewsResult, FuseStep, PairResult, PairTables, Support, ViewResult,
    Views, all_pairs,
};
pub use skeleton_step::{Combine, FusedView, Skeleton, SkeletonSettings, SkeletonStep};
pub use view_step::{EvidenceWindow, ViewEstimate, ViewSettings, ViewStep};
