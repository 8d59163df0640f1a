//! `pose2d.jsonl`: a line for every view of a frame, before and after fusion.

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;

/// A line of `pose2d.jsonl`. Coordinates are pixels of the footage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewLine {
    /// Direction in which the person faces; `None` if it was not decided.
    #[serde(deserialize_with = "nullable")]
    pub facing: Option<Facing>,
    /// Number of the frame in the footage.
    pub frame: u64,
    /// The pose on which all views agreed. Left and right parts are named by the person's own sides.
    #[serde(deserialize_with = "nullable")]
    pub fused: Option<FusedPose>,
    /// Extent of the search in the frame (`full`, `tracked`); `None` if there was no pose.
    #[serde(deserialize_with = "nullable")]
    pub search: Option<String>,
    /// Expected error of every part in this frame, in pixels; `None` if none was predicted.
    #[serde(deserialize_with = "nullable")]
    pub sigma_px: Option<Vec<f64>>,
    /// Age of the expected errors that fusion used, in frames; `None` if fusion used none.
    #[serde(deserialize_with = "nullable")]
    pub sigma_used: Option<u16>,
    /// The best pose of the view alone. Left and right parts are named by the sides of the image, as in the model.
    #[serde(deserialize_with = "nullable")]
    pub single: Option<SinglePose>,
    /// `ok`, or the reason why there is no pose of the view alone.
    pub status: String,
    /// Time at which the frame was taken, in seconds after frame 0 of the footage, if its rate is known.
    #[serde(deserialize_with = "nullable")]
    pub time_s: Option<f64>,
    /// Name of the camera.
    pub view: String,
}

/// Direction in which a person faces, seen from a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", try_from = "String")]
pub enum Facing {
    /// Towards the camera: left and right are named as in the model.
    Front,
    /// Away from the camera: left and right were swapped.
    Behind,
}

impl TryFrom<String> for Facing {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.as_str() {
            "front" => Ok(Self::Front),
            "behind" => Ok(Self::Behind),
            other => Err(format!(
                "found \"{other}\", expected \"front\" or \"behind\""
            )),
        }
    }
}

/// A pose after fusion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FusedPose {
    /// Sum of the joint energies of the pairs that were averaged; `None` if it is not finite.
    #[serde(deserialize_with = "nullable")]
    pub energy: Option<f64>,
    /// Number of pairs that were averaged; 0 if the pose is the view's own.
    pub pairs: u32,
    /// Centre of every part.
    pub parts: Vec<Part>,
}

/// The centre of a part, in pixels of the footage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Column, counted to the right.
    #[serde(deserialize_with = "nullable")]
    pub x: Option<f64>,
    /// Row, counted downwards.
    #[serde(deserialize_with = "nullable")]
    pub y: Option<f64>,
}

/// A pose of one view alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SinglePose {
    /// Number of candidates that the view had.
    pub candidates: u64,
    /// Level of the pyramid, counted from 1; null with the network method.
    #[serde(deserialize_with = "nullable")]
    pub level: Option<u64>,
    /// Position and type of every part.
    pub parts: Vec<TypedPart>,
    /// Score of the best candidate.
    #[serde(deserialize_with = "nullable")]
    pub score: Option<f64>,
}

/// The centre of a part, in pixels of the footage, and its type.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TypedPart {
    /// Type of the part, counted from 1; null with the network method.
    #[serde(rename = "type", deserialize_with = "nullable")]
    pub part_type: Option<u64>,
    /// Column, counted to the right.
    #[serde(deserialize_with = "nullable")]
    pub x: Option<f64>,
    /// Row, counted downwards.
    #[serde(deserialize_with = "nullable")]
    pub y: Option<f64>,
}
