//! Synthetic scenes: rendered people in rendered rooms, seen by calibrated cameras, with the true joint positions.
//!
//! [`Settings`] define a scene completely: the cameras, the number of the subject, the action, the seed, and the flaws of the cameras. A
//! [`Scene`] is created from these settings. A [`View`] of the scene renders the pictures of one camera and the ground truth of each
//! picture ([`truth`]). An [`Address`] describes one camera of a scene in one line, `synth://...`, for a process that renders one camera
//! live. The same settings give bit-identical pictures, regardless of the order and the process in which they are rendered.
//!
//! The *stage* is the area in which the person acts. It also means the frame of reference there: origin on the floor, z up.
//!
//! # How it works
//!
//! A person is a union of some forty smooth solids on the bones of an anatomical skeleton. The surface is created once, as small triangles,
//! and follows the bones. Every corner of the triangles is projected with the camera's full model, including distortion. A z-buffer with
//! four samples per pixel determines the visible surface. The room is rendered by casting rays through the same camera; it does not move,
//! so this is done once per camera. One lamp casts soft shadows.
//!
//! The module `raster` is used because published software renderers (`euc`, `retrofire`) do not support lens distortion and are larger.
#![forbid(unsafe_code)]

mod colour;

mod body;
mod fabric;
mod mesh;
mod motion;
mod performance;
mod random;
mod recorded;
mod shape;
mod subject;
mod wear;

mod light;
mod photo;
mod room;

mod backdrop;
mod painter;

mod bystander;
mod raster;
mod shadow;

mod flaws;
mod rigs;
mod settings;

mod scene;
pub mod truth;

pub use body::N_EXTRAS;
pub use flaws::{FlawError, Flaws};
pub use motion::Action;
pub use photo::photos_in;
pub use recorded::{Posture, Recording};
pub use rigs::{RigChoice, RigChoiceError};
pub use scene::{Scene, SceneError, View, camera_of, skew_ms_of};
pub use settings::{Address, AddressError, Settings};
