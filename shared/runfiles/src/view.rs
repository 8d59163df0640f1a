//! `pose2d.jsonl`: a line for every view of a frame, before and after fusion.

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;

/// A line of `pose2d.jsonl`. Coordinates are pixels of the footage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewLine {
    /// Which way the person faces; none where that was not decided.
    #[serde(deserialize_with = "nullable")]
    pub facing: Option<Facing>,
    /// Number of the frame in the footage.
    pub frame: u64,
    /// The pose that all views agreed on, parts by the side of the body.
    #[serde(deserialize_with = "nullable")]
    pub fused: Option<FusedPose>,
    /// How the frame was searched (`full`, `tracked`); none where there was no pose.
    #[serde(deserialize_with = "nullable")]
    pub search: Option<String>,
    /// Expected error of every part in this frame, pixels; none where none was predicted.
    #[serde(deserialize_with = "nullable")]
    pub sigma_px: Option<Vec<f64>>,
    /// How many frames before this one the expected errors that fusion used were predicted; none where it had none.
    #[serde(deserialize_with = "nullable")]
    pub sigma_used: Option<u16>,
    /// The best pose of the view alone, parts by the side of the image as in the model.
    #[serde(deserialize_with = "nullable")]
    pub single: Option<SinglePose>,
    /// `ok`, or why there is no pose of the view alone.
    pub status: String,
    /// When the frame was taken, seconds after frame 0 of the footage, where its rate is known.
    #[serde(deserialize_with = "nullable")]
    pub time_s: Option<f64>,
    /// The camera.
    pub view: String,
}

/// Which way a person faces, seen from a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", try_from = "String")]
pub enum Facing {
    /// Towards the camera: sides of the body are those of the model.
    Front,
    /// Away from it: left and right were exchanged.
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
    /// Sum of the joint energies of the pairs that were averaged; none where it is not finite.
    #[serde(deserialize_with = "nullable")]
    pub energy: Option<f64>,
    /// Pairs that were averaged; 0 if the pose is the view's own.
    pub pairs: u32,
    /// Centre of every part.
    pub parts: Vec<Part>,
}

/// The centre of a part, pixels of the footage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// To the right.
    #[serde(deserialize_with = "nullable")]
    pub x: Option<f64>,
    /// Down.
    #[serde(deserialize_with = "nullable")]
    pub y: Option<f64>,
}

/// A pose of one view alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SinglePose {
    /// Candidates that the view had.
    pub candidates: u64,
    /// Level of the pyramid, from 1; null by the method of networks.
    #[serde(deserialize_with = "nullable")]
    pub level: Option<u64>,
    /// Every part.
    pub parts: Vec<TypedPart>,
    /// Score of the best candidate.
    #[serde(deserialize_with = "nullable")]
    pub score: Option<f64>,
}

/// The centre of a part, pixels of the footage, and its type.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TypedPart {
    /// From 1; null by the method of networks.
    #[serde(rename = "type", deserialize_with = "nullable")]
    pub part_type: Option<u64>,
    /// To the right.
    #[serde(deserialize_with = "nullable")]
    pub x: Option<f64>,
    /// Down.
    #[serde(deserialize_with = "nullable")]
    pub y: Option<f64>,
}
