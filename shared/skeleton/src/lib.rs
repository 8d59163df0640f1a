//! Definitions of the body: parts of the 26-part model, evaluated joints, the maps between them, and bone lengths ([`body`]).
//!
//! A *part* is found by the part model (a filter on the image); a *joint* is evaluated.
//! Parts are numbered from 0 here, but from 1 in the reference programs and in everything a user
//! sees. The model names its parts by the side of the *image* on which they are when the person
//! faces the camera; `mirror` exchanges them for a person seen from behind.
#![forbid(unsafe_code)]

pub mod body;
mod joints;
mod parts;

pub use joints::{HUMANEVA20, Joint, JointMap, JointSet, MIRRORED, PARSE14, SIDES, UMPM15};
pub use parts::{MIRROR, N_PARTS, PARENT, PART_NAMES};
