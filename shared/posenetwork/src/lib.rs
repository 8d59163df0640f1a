//! Networks that find keypoints as the evidence of a view, in place of the filters.
//!
//! [`PoseNetwork`] is a network with its card: a picture and a box around a person in, a [`Sight`] out. [`JointMaps`] are the
//! logarithms of its maps for the 14 joints of the skeleton, from which the responses of a view are filled
//! ([`JointMaps::fill`]). [`springs::learn`] learns the tree that holds the joints together: a mixture of Gaussian springs
//! (Yang & Ramanan 2013 with the unary of Chen & Yuille 2014, without their image-dependent part).
#![forbid(unsafe_code)]

mod alone;
mod between;
mod bumps;
mod closer;
mod detector;
mod expected;
mod found;
mod maps;
mod network;
mod outline;
pub mod springs;

pub use between::interpolate;
pub use bumps::{Bump, MOST_OF_A_JOINT, bumps, fill_from_bumps};
pub use closer::{Look, LookMemory, Looker};
pub use detector::Detector;
pub use expected::expected_error;
pub use maps::{JointMaps, MapSettings};
pub use network::{FitError, LookError, PoseNetwork, Sight, Turn, Workspace};
pub use outline::{OF_FILTERS, outline_of, outline_of_parts, outline_of_pose, overlap};
