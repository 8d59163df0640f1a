//! The body: parts of the 26-part model, evaluated joints, the maps between them, and how long bones are ([`body`]).
//!
//! A *part* is what the model of parts finds (a filter on the image); a *joint* is what is evaluated.
//! Parts are numbered from 0 here, and from 1 in the reference programs and in everything a user
//! sees. The model names its parts by the side of the *image* on which they lie when the person
//! faces the camera; `mirror` exchanges them for a person seen from behind.
#![forbid(unsafe_code)]

pub mod body;
mod joints;
mod parts;

pub use joints::{HUMANEVA20, Joint, JointMap, JointSet, MIRRORED, PARSE14, SIDES, UMPM15};
pub use parts::{MIRROR, N_PARTS, PARENT, PART_NAMES};
