//! One energy over several views, maximised by alternating exact single-view solutions.
//!
//! The crate implements the paper's sections 4 to 6. Reading order: [`Settings`]; [`ViewPlan`] and [`ViewInput`], the data of a view;
//! [`choose_start`], which selects each view's candidate that shows the person; [`estimate_pair`], which optimises a pair, and
//! [`estimate_all_views`], which optimises all views at once; [`rank_facing`], [`FacingFilter`], [`average`] and [`consensus()`], which
//! combine the pairs into one pose per view.
//!
//! # The appearance term
//!
//! The paper adds `beta p(t_A, t_B)`, the frequency with which two types occur together, and every pair of cameras needs its own table. The
//! authors' program adds `beta p(t_target | t_support)`. Both forms also reward types that are frequent anyway, although the biases of the
//! single view already do this. A consistency file (from `parallax-lab train consistency`) therefore also contains the logarithm of the
//! ratio to chance (`ln p(a, b) / (p(a) p(b))`, "lift"), which is 0 if nothing is known. Cross-validation chooses between this value and
//! the paper's.
//!
//! [`AngleTables`] are for rigs without training data. How a person looks in two views depends on the angle between the views, so tables
//! are learned on rings of cameras and looked up by [`angle_between`], in bins of equal width. In a view from behind, left and right are
//! swapped. For pairs with one such view, there are separate tables ([`TypeTables::exchanged`]). Without these tables, such pairs have no
//! appearance term, as with the authors' files.
//!
//! The benefit was measured with three person models; the results of pairs were averaged. Each cell shows PCP3D (in percent) / MPJPE (in
//! mm). The first model confused left and right: for one sixth of the people in its training data, they were labelled the wrong way round.
//! Its tables were made from 95 instants in front of rings of 3, 5, 6 and 8 cameras (walking, boxing, gestures, sitting, grabbing). The
//! tables of the other two models were made from 900 instants in front of rings of 3 to 9 cameras; the third model is the included one. The
//! test sets are:
//!
//! * A: 24 instants of other synthetic people who jog and throw, rendered for the three cameras of `HumanEva-I` at 320 x 240.
//! * B: 30 instants of other synthetic people in five actions, rendered for the same cameras at 640 x 480.
//! * C: 14 frames of a real person who balances, seen by four cameras; not used for training.
//!
//! These tests are small: the 95 % interval of an improvement on A is almost 20 points wide.
//!
//! | | first model: A | B | C | second model: A | B | C | third model: A | B | C |
//! |---|---|---|---|---|---|---|---|---|---|
//! | every view alone, left and right decided over all views | 74.0 / 141 | 54.7 / 233 | 58.9 / 264 | 72.9 / 152 | 46.4 / 286 | 59.5 / 269 | 75.0 / 140 | 46.1 / 287 | 60.1 / 274 |
//! | geometry, alpha 0.002 | 69.1 / 160 | 56.9 / 210 | 73.2 / 150 | 76.4 / 134 | 60.8 / 189 | 77.4 / 151 | 76.4 / 132 | 63.3 / 188 | 79.2 / 152 |
//! | + appearance, the paper's form (beta 0.1; 0.03 for the third model) | 76.4 / 128 | 63.3 / 189 | 75.6 / 137 | 74.0 / 140 | 62.2 / 190 | 74.4 / 158 | 78.8 / 122 | 59.2 / 202 | 83.3 / 131 |
//! | + parts switched off by their true errors (explained below) | 76.7 / 120 | 62.2 / 189 | | 76.7 / 126 | 67.5 / 171 | | 85.8 / 100 | 64.4 / 178 | 83.3 / 119 |
//!
//! So part types helped most with the first model, whose training labels were inconsistent. With a consistent model, most of the
//! improvement comes from geometry. The weight for the third model was chosen on 60 other instants.
//!
//! The rest of this section refers to the first model, whose weight was chosen on A and C. With a weight of 0.02, the lift reached a PCP3D
//! of 73.3 % on A; weights of 0.1 and more reduced the result on five held-out instants. "Every view alone" is a strong baseline, because
//! it also decides left and right over all views. Without this decision, its PCP3D falls to 55.6 % on A and 45.8 % on C, so that geometry
//! appears to gain 13 to 27 points.
//!
//! All versions are limited by errors of left and right. In a tenth (views alone) to a fifth (geometry) of the instants of B, left and
//! right of the whole person are swapped, which costs 4 to 9 points. Those are single frames; in a video, the decision is tracked over time
//! ([`FacingFilter`]).
//!
//! # Why switching parts off by their true errors can reduce the result
//!
//! Eq. 6 switches a part off if its error is too large in *either* view. A wrong view is then not corrected, although that is the purpose
//! of the terms. With the true errors, and their medians as thresholds (the paper's tau, learned), more than half of the terms are switched
//! off, and the PCP3D on A falls from 76.4 % to 66.0 %. The authors' program uses the error of the *support* alone, so that a good view
//! continues to correct a bad one ([`SwitchBy::Support`]). This gives 76.7 / 120 on A, and 78.1 / 117 with consensus. So the rule of eq. 6
//! costs ten points. Even without this rule, the benefit of knowing all errors is small here: 62.2 / 189 on B, and 65.8 / 181 with
//! consensus.
//!
//! With [`SwitchBy::Worse`], the better of two bad views continues to support the other. So the views still support each other if large
//! errors are expected everywhere. A network that expects too many errors needs this rule. The shipped network (`person.quality.onnx`) is
//! such a network: for seven in ten of the correctly placed parts of the real person, it expects an error that switches the part off. The
//! network is only used if it is configured.
//!
//! # Results on more instants
//!
//! The instants of this section were rendered after all choices above had been made. They were evaluated with the third model and its
//! consistency file: 60 instants of ten people who jog and throw (`parallax-lab synth --rig humaneva --subjects 501-510 --actions
//! jogging,throw-catch --frames 3 --rate 2 --seed 4711`, evaluated at 320 x 240), 60 of six people in five actions (`--subjects 601-606
//! --actions walking,boxing,gestures,chair,grab --frames 2 --rate 2 --seed 991`, 640 x 480), and the 14 frames of C. Each cell shows PCP3D
//! in percent for pairs averaged, pairs in consensus, and all views at once (with averaged terms), in this order.
//!
//! | | jog, throw | five actions | C | all 134 |
//! |---|---|---|---|---|
//! | every view alone | 66.5 | 62.5 | 60.1 | 64.1 |
//! | geometry | 72.4, 73.5, 75.6 | 67.6, 69.2, 68.2 | 79.2, 80.4, 85.1 | 71.0, 72.3, 73.3 |
//! | + appearance | 70.8, 71.7 | 66.7, 67.6 | 83.3, 86.3 | 70.3, 71.4 |
//! | + network, [`SwitchBy::Worse`] | 75.3, 75.7, 74.2 | 72.9, 71.8, 74.0 | 83.3, 92.9, 91.1 | 75.1, 75.7, 75.9 |
//! | + true errors, [`SwitchBy::Worse`] | 77.9, 78.9, 77.8 | 72.4, 73.3, 74.2 | 79.8, 95.2, 91.7 | 75.6, 78.1, 77.6 |
//! | + true errors, [`SwitchBy::Support`] | 77.1, 77.8, 79.2 | 71.5, 72.1, 72.5 | 83.3, 94.0, 94.0 | 75.2, 76.9, 77.7 |
//!
//! So with this model, geometry gains 7 points, and part types gain nothing. With pairs averaged, the network gains 4.8 points, and the
//! true errors would gain 5.3; with consensus, the network gains 4.3 points, and the true errors would gain 6.7. Fusion makes some parts
//! worse by more than 5 pixels than in the single view: 13.1 % of all parts in all views with appearance, 9.4 % with the network, and 8.6 %
//! with the true errors. The network's card (`configs/models/person.quality.md`) has results for more test sets.
//!
//! Two variants were tried with an earlier network, whose PCP3D was 73.3 % with pairs averaged and 73.8 % in consensus. First, switches
//! were replaced by gradual weights: `min(1, (tau / sigma)^2)`, or the same ratio between the two views. This was no better: 73.1 % and
//! 73.3 % with pairs averaged, and 73.4 % for both in consensus. Second, the thresholds of two views were raised by a common factor if more
//! than half of their parts were expected to be off. On the real person (C), this changed the PCP3D from 78.0 % to 80.4 % with pairs
//! averaged, from 86.3 % to 85.7 % in consensus, and from 81.5 % to 85.1 % with all views at once. With the shipped network, it changes the
//! results on sets of 60 and more instants by 2.5 points at most, and reduces those on C by 0.6, 1.8 and 5.4 points.
//!
//! # A cap on distances
//!
//! Setting `max_distance_cells` to 4 or 8 makes little difference on synthetic people: PCP3D is 43.2 % and 43.8 %, compared with 43.4 %
//! without a cap, on 44 instants rendered for the cameras of `HumanEva-I` and UMPM. On the 14 frames of set C, a cap of 4 reduces PCP3D
//! from 73.2 % to 68.5 %. The default is no cap, which is the paper's form; a deployment can set one.
#![forbid(unsafe_code)]

pub mod learned;
mod settings;

mod pair;
mod term;
mod view;
mod who;

mod consistency;
mod heat_map;
mod released;

mod all_views;
mod average;
mod consensus;
mod facing;
mod optimise;
mod space_apart;
mod space_person;
mod space_places;
mod space_solve;
mod space_tree;
mod space_view;
mod start;

mod anatomy;
mod angle;
mod compatibility;
mod front;
mod sides;

pub use all_views::{AllViewsEstimate, AllViewsInput, AllViewsStart, estimate_all_views};
pub use anatomy::anatomical_evidence;
pub use angle::{AngleTables, angle_between};
pub use average::{FusedPose, anatomical, average};
pub use compatibility::{Compatibility, CompatibilityError};
pub use consensus::{ConsensusSettings, ConsensusWorkspace, Sightings, consensus};
pub use facing::{
    Exchanges, Facing, FacingFilter, FacingHypothesis, FacingSettings, PairEnergies, is_exchanged,
    rank_facing,
};
pub use front::{FrontEvidence, front, front_in_view, front_log_ratio, front_log_ratio_of};
pub use heat_map::heat_map;
pub use optimise::{Iteration, PairEstimate, PairStart, estimate_pair};
pub use pair::PairInput;
pub use settings::{EnergyKind, Settings, SwitchBy, TypeTables};
pub use sides::{Sides, SidesFilter, SidesSettings};
pub use space_person::{SolvedPerson, solve_person};
pub use space_tree::{BoneLength, SpacePose, SpaceSettings, TREE, lengths_of};
pub use space_view::{JointEvidence, SpaceView};
pub use start::{Start, choose_start, rank_starts};
pub use term::Epipolar;
pub use view::{ViewInput, ViewPlan};
pub use who::{SeenPerson, same_person};
