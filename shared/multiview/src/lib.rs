//! One energy over several views, maximised by alternating exact single-view solutions.
//!
//! The paper's sections 4 to 6. Reading order: [`Settings`]; [`ViewPlan`] and [`ViewAnswer`], what a
//! view brings; [`choose_start`], which candidate of every view is the person; [`estimate_pair`], the
//! optimiser of a pair, [`estimate_all_views`], that of all views at once; [`rank_facing`], [`FacingFilter`], [`average`] and [`consensus()`], from the pairs back to one pose per view.
//!
//! # The appearance term
//!
//! The paper adds `beta p(t_A, t_B)`, the frequency with which two types come together, and a pair of cameras needs a table
//! of its own. The authors' program adds `beta p(t_target | t_support)`; either form also rewards what is frequent anyway, which the
//! single view's own biases have been trained for. A consistency file (`parallax train consistency`) therefore offers, beside the
//! paper's form, how much more often than by chance two types come together (`ln p(a, b) / (p(a) p(b))`, "lift"), which is 0
//! where nothing is known; cross-validation chooses between the two.
//!
//! [`AngleTables`] serve rigs that nobody trained on: what two views see of a person depends on the angle between them, so
//! tables learned on rings of cameras are looked up by [`angle_between`], in bins of equal width. A view from behind names left
//! and right the other way round: pairs of which one view is from behind were without the term, and have tables of their
//! own here ([`TypeTables::exchanged`]); where these are missing they still go without, as with the authors' files.
#![forbid(unsafe_code)]

mod settings;

mod term;
mod view;

mod consistency;
mod heat_map;
mod released;

mod all_views;
mod average;
mod consensus;
mod facing;
mod optimise;
mod start;

mod anatomy;
mod angle;
mod compatibility;

pub use all_views::{AllViewsEstimate, AllViewsInput, AllViewsStart, estimate_all_views};
pub use anatomy::anatomical_evidence;
pub use angle::{AngleTables, angle_between};
pub use average::{FusedPose, anatomical, average};
pub use compatibility::{Compatibility, CompatibilityError};
pub use consensus::{ConsensusSettings, Sightings, consensus};
pub use facing::{
    Exchanges, Facing, FacingFilter, FacingHypothesis, FacingSettings, PairEnergies, is_exchanged,
    rank_facing,
};
pub use heat_map::heat_map;
pub use optimise::{Iteration, PairEstimate, PairInput, PairStart, estimate_pair};
pub use settings::{EnergyKind, Settings, TypeTables};
pub use start::{Start, choose_start, rank_starts};
pub use term::Epipolar;
pub use view::{ViewAnswer, ViewPlan};
