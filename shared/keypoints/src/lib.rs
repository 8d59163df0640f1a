//! Networks that find the keypoints of one person in a box: their cards, and the decoding of their outputs.
//!
//! A [`Card`] is a TOML file beside an ONNX file. It describes the network's input ([`Input`]), how the box around a person becomes this
//! input ([`Crop`]), the output ([`Codec`]), and the names of the keypoints ([`KeypointNames`]). With a card, any network can be used: this
//! crate has no code for particular networks.
//!
//! | codec | output of the network | read by |
//! |---|---|---|
//! | `heat-map` | a map for every keypoint | [`HeatMaps`] |
//! | `simcc` | a distribution over columns and one over rows for every keypoint (Li et al. 2022) | [`SimCc`] |
//! | `keypoints` | positions and scores | [`List`] |
//!
//! Coordinates of the network's input have pixel centres at integers, column first. [`Window`] maps them to the picture. [`files`]
//! reads the results of other programs from their files.
//!
//! This crate does not run networks.
#![forbid(unsafe_code)]

mod card;
mod decode;
mod detector;
pub mod files;
pub mod keypointfiles;
mod names;
mod shipped;
mod window;

pub use card::{
    Also, Card, CardError, CardKind, Codec, Colour, Crop, Fit, Input, KeypointNames, Layout,
    ListField, ListUnit, Numbers, Refine, Score, Sides,
};
pub use decode::{HeatMaps, Keypoint, List, OutputError, SimCc};
pub use detector::{Boxes, DetectorCard, PersonBox};
pub use names::{
    BODY_25, BODY_25B, COCO_17, COCO_FEET_23, HALPE_26, LSP_14, MPII_16, OPENPOSE_18, SETS,
    WHOLE_BODIES, Way, is_joint, joint_rows, joint_ways, mirrored,
};
pub use shipped::{SHIPPED, SHIPPED_DETECTORS};
pub use window::{Window, outline};
