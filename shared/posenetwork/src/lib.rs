//! Networks that find people and their keypoints in pictures. The results are the evidence of a view.
//!
//! [`PoseNetwork`] is a network with its card: it takes a picture and a box around a person, and returns a [`Sight`]. [`JointMaps`] are the
//! logarithms of its maps for the 14 joints of the skeleton. [`PersonMaps`] are the same maps with their position in the picture.
#![forbid(unsafe_code)]

mod alone;
mod behind;
mod between;
mod bumps;
mod closer;
mod cover;
mod detector;
mod expected;
mod found;
mod maps;
mod network;
mod outline;
mod person_maps;

pub use bumps::{Bump, MOST_OF_A_JOINT, bumps, fill_from_bumps};
pub use closer::{Look, LookMemory, Looker};
pub use cover::Bar;
pub use detector::Detector;
pub use expected::expected_error;
pub use maps::{JointMaps, MOST_CELLS, MapSettings};
pub use network::{FitError, LookError, PoseNetwork, Sight, Turn, Workspace};
pub use outline::{outline_of, overlap};
pub use person_maps::{JointMap, MapGrid, MapKind, Peak, PersonMaps};
