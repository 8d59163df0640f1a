//! Definitions of the body: parts of the 26-part model, evaluated joints, the maps between them, and bone lengths ([`body`]).
//!
//! A *part* is what the part model finds with a filter on the image; a *joint* is what results and data sets contain. Parts are numbered
//! from 0 here, but from 1 in the reference programs and in everything a user sees. The model names left and right parts by their side in
//! the *image* when the person faces the camera; for a person seen from behind, `mirror` swaps them.
#![forbid(unsafe_code)]

pub mod body;
mod joints;
mod parts;

pub use joints::{HUMANEVA20, Joint, JointMap, JointSet, MIRRORED, PARSE14, SIDES, UMPM15};
pub use parts::{MIRROR, N_PARTS, PARENT, PART_NAMES};
