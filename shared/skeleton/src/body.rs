//! Human bodies: how long people's bones are, and what this means for a skeleton found in 3D.
//!
//! The pictures show where joints may be; this module decides which of these joints can belong to a person. It contains the lengths of
//! bones as fractions of the stature, with their spread among people and the published source of every number ([`Kind::proportion`]). It
//! answers five questions:
//!
//! | question | answer |
//! |---|---|
//! | how tall is the person? | [`stature`] |
//! | is this skeleton a person, and which joints are impossible? | [`check`] |
//! | which of many candidate skeletons is most like a person? | [`deviation`]: fast enough for many calls per frame |
//! | how long are the bones of this individual? | [`Lengths`], learned over a run |
//! | where are the joints, given that bones keep their lengths? | [`refine`]: a soft prior in triangulation |
//!
//! The joints are the 14 joints of `crate::PARSE14` in its order, in metres in the world. A joint that is not finite, or
//! farther than 1000 km from the origin, is treated as missing. The functions do not use the vertical, so a body may also lie or
//! hang. Only [`Lengths::default`] allocates memory. The same input gives bit-identical results.
//!
//! # What is published, and what is our own choice
//!
//! These numbers are published: the bone lengths of adults as fractions of the stature, their spread among adults, and the statures of
//! adults and children. The others are our own choice: the bone lengths of a small child (derived from published data, see
//! [`Kind::proportion`]), the differences between detectors and data sets in the position of a joint ([`Proportion::place`]), the effect of
//! posture ([`Proportion::posture`]), and the error of a measured length ([`MEASUREMENT_SD`]). The limits are wide on purpose, because the
//! detector's error is 5 to 15 cm, and joints that count as impossible are removed.

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

/// Number of joints in `crate::PARSE14`.
pub const N_JOINTS: usize = 14;

/// The joints of `crate::PARSE14` in its order, in metres in the world; `None` for a missing joint.
pub type Joints = [Option<Point3<f64>>; N_JOINTS];

/// The covariance of every joint, in square metres in the world; `None` if it is unknown.
pub type Covariances = [Option<Matrix3<f64>>; N_JOINTS];
