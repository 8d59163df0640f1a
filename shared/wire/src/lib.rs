//! Converts messages to domain types and back, with checks in both directions.
//!
//! A received message was written by another process. Every count, index and number is therefore compared with its
//! limit before it is used. The [`Model`](fmp::Model) and the [`Layout`](fmp::Layout) define the limits.
//! Entries past a count are ignored when read and zero when written.
#![forbid(unsafe_code)]

mod all_views;
mod error;
mod evidence;
mod pair;
mod people;
mod pose;
mod quality;
mod sightings;
mod skeletons;
mod stamp;

pub use all_views::{all_views_from_pairs, all_views_to_messages, check_all_views};
pub use error::WireError;
pub use evidence::{EvidenceView, evidence_from_message, evidence_to_message};
pub use pair::{check_views, pair_from_message, pair_to_message};
pub use people::{people_from_message, people_to_message};
pub use pose::{
    candidates_from_message, candidates_to_message, extras_from_message, extras_to_message,
    front_from_message, front_to_message, local_from_message, local_to_message, pose_from_message,
    pose_to_message, skew_from_message,
};
pub use quality::{
    sigma_from_message, sigma_from_pair, sigma_to_message, sigma_to_pair, tau_from_message,
    tau_to_message,
};
pub use sightings::{
    grids_from_message, maps_from_message, maps_to_message, n_values, sightings_from_message,
    sightings_to_message,
};
pub use skeletons::{SolvedPerson, check_skeletons, end_of_results, skeletons_to_message};
pub use stamp::{Expected, check_frame};

#[cfg(test)]
mod testing;
