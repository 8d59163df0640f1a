//! Synthetic scenes: rendered people in rendered rooms, seen by calibrated cameras, with the true joint positions.
//!
//! [`Settings`] hold everything: the cameras, the number of the subject, the action, the seed, the flaws of the
//! cameras. A [`Scene`] is made of them; a [`View`] of it makes the pictures of one camera and the ground truth
//! of each ([`truth`]). An [`Address`] is one camera of a scene in one line, `synth://...`, for a process that
//! shows one camera live. The same settings give the same bits, in whatever order and wherever pictures are made.
//!
//! The *stage* is the place where the person acts, and its frame of reference: origin on the floor, z up.
//!
//! # How it works
//!
//! A person is a union of some forty smooth solids on the bones of an anatomical skeleton; its surface is
//! made once and follows the bones. Every corner of its small triangles is projected by the camera itself,
//! distortion included, and a z-buffer with four samples a pixel finds what is seen. The room, cast as rays
//! through the same camera, does not move and is made once for a camera. One lamp throws soft shadows.
//!
//! Published software renderers (`euc`, `retrofire`) have no lens distortion and are larger than `raster`.
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
