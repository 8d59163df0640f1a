//! Bodies as they are: how long people's bones are, and what follows for a skeleton found in space.
//!
//! The pictures say where joints may be; this crate says which of that can be a person. It knows the lengths of
//! bones as shares of the stature, with their spread among people and the published source of every number
//! ([`Kind::proportion`]), and answers five questions:
//!
//! | question | answer |
//! |---|---|
//! | how tall is the person? | [`stature`] |
//! | is this skeleton a person, and which joints are impossible? | [`check`] |
//! | which of many starts looks most like a person? | [`deviation`]: cheap, for many calls a frame |
//! | how long are the bones of this very person? | [`Lengths`], learned over a run |
//! | where are the joints, if bones keep their lengths? | [`refine`]: a soft prior in triangulation |
//!
//! Joints are the 14 of `crate::PARSE14` in its order, in metres in the world. A joint that is not finite, or
//! farther than 1000 km from the origin, counts as missing everywhere. Nothing here knows up or down: a body lying or
//! hanging is a body. Nothing is allocated but by [`Lengths::default`]; the same input gives the same bits.
//!
//! # What is published, and what is our own choice
//!
//! Published: the shares of the stature and their spread among adults, statures of adults and children. Our own:
//! the shares of a small child (composed from what is published, see [`Kind::proportion`]), how differently detectors
//! and data sets place the same joint ([`Proportion::place`]), what postures change ([`Proportion::posture`]), and the
//! error of a measured length ([`MEASUREMENT_SD`]).
//! The limits are wide on purpose: the detector errs by 5 to 15 cm, and what is called impossible is taken away.

mod bone;
mod check;
mod deviation;
mod lengths;
mod proportion;
mod reach;
mod refine;
mod stature;
#[cfg(test)]
mod testing;
mod verdict;

use nalgebra::{Matrix3, Point3};

pub use bone::{BONES, Bone, N_BONES};
pub use check::{LIMIT, check};
pub use deviation::{DEVIATION_CAP, deviation};
pub use lengths::{Learned, Lengths, MAX_FRAMES, MIN_FRAMES};
pub use proportion::{CHILD_AND_ADULT, Kind, MEASUREMENT_SD, Proportion};
pub use refine::{Refined, refine};
pub use stature::{MIN_BONES, STATURES, Stature, stature};
pub use verdict::{Reason, Verdict};

/// Number of joints, those of `crate::PARSE14`.
pub const N_JOINTS: usize = 14;

/// The joints of `crate::PARSE14` in its order, metres in the world; `None` where a joint is missing.
pub type Joints = [Option<Point3<f64>>; N_JOINTS];

/// The covariance of every joint, square metres in the world; `None` where it is unknown.
pub type Covariances = [Option<Matrix3<f64>>; N_JOINTS];
