//! Cameras and points: projection, undistortion, framing, triangulation, and calibration files.
//!
//! All numbers are `f64`. The world is in metres. Cameras look along +z, with x to the right and y down (`OpenCV`), and are stored as
//! `camera_from_world`. The centre of the top-left pixel is (0, 0).
//!
//! A *pixel* is a point of the recorded, distorted image. An *ideal pixel* is the position of the same ray in a pinhole camera with the
//! same focal lengths and principal point.
//!
//! The crate uses no clock and no threads. Only [`files::read`], [`files::read_many`] and [`files::write`] do input or output.
#![forbid(unsafe_code)]

mod lens;

mod camera;
mod extent;

mod rig;

pub mod epipolar;

mod framing;

pub mod bundle;

pub mod search_size;

mod survey;

mod triangulate;

mod rig_watch;

pub mod skew;

mod step_watch;

mod up;

mod wide;

pub mod files;

#[cfg(test)]
mod testing;

pub use camera::{Camera, Intrinsics, Ray};
pub use extent::longer_side;
pub use framing::{Framing, FramingError, OutSize, upright_roll};
pub use lens::{Lens, LensModel};
pub use rig::{
    LeftOut, NotARotation, PLAIN_NAME, Rig, RigError, is_plain_name, rotation_from_matrix,
};
pub use rig_watch::{Contradiction, RigWatch, Suspect, Swap, SwapWatch};
pub use step_watch::{OUT_OF_STEP_MS, Step, StepWatch};
pub use survey::{Place, Shared, Survey, survey};
pub use triangulate::{
    MAX_VIEWS, Observation, Settings, TriangulateError, Triangulated, triangulate,
};
pub use up::{direction, y_up_from_world, z_up_from_world};
pub use wide::{Sightline, widest_apart};
