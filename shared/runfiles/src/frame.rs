//! `pose3d.jsonl`: a line for every frame, with its skeletons or the reason why it is missing.

use std::collections::BTreeMap;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::Missing;
use crate::nullable::{nullable, numbers};

/// Maximum number of people of a line.
pub const MOST_PEOPLE: usize = 8;

/// A line of `pose3d.jsonl`, and of `pose3d-smooth.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameLine {
    /// Number of the frame in the footage.
    pub frame: u64,
    /// The people, the followed person first, each with a different id. Empty in a line without a result.
    #[serde(deserialize_with = "people")]
    pub people: Vec<PersonLine>,
    /// Reason why there is no result; only in a line without a result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Number of people on whom the views agree, including people who are not in the list. `None` in a line without a result, and if the
    /// model is not of people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<u32>,
    /// [`FrameLine::OK`] if any person has a skeleton, [`FrameLine::NO_RESULT`], or the reason why no person has one.
    pub status: String,
    /// Time at which the frame was taken, in seconds after frame 0 of the footage, if its rate is known.
    #[serde(deserialize_with = "nullable")]
    pub time_s: Option<f64>,
    /// Views that did not contribute to the result, with the reasons.
    pub views_missing: BTreeMap<String, Missing>,
    /// Views that contributed to the result.
    pub views_present: Vec<String>,
}

/// A person of a line.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PersonLine {
    /// Deviation of the bone lengths from the bone lengths of real people, in standard deviations; `None` if there is no body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_deviation: Option<f64>,
    /// Margin of the decision about which views see the person from the same side; `None` if it was
    /// not made.
    #[serde(deserialize_with = "nullable")]
    pub facing_margin: Option<f64>,
    /// The person's id within the run, counted from 1.
    pub id: u64,
    /// The joints, by name.
    pub joints: BTreeMap<String, JointLine>,
    /// Poses from which the skeleton was made: the poses that fusion solved for, or those from which it started.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Kept>,
    /// Extra keypoints of networks, which are not joints (face, feet, hands), by name. Each was triangulated separately. Empty if no
    /// network finds such keypoints.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub keypoints: BTreeMap<String, JointLine>,
    /// Number of pairs of views that contributed to the skeleton.
    pub pairs: u32,
    /// How certain left and right are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<Sides>,
    /// Log-odds that left and right are not swapped in all views, in nats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides_margin: Option<f64>,
    /// State of every joint and keypoint with a position: `measured`, `exchanged`, `filled` or `rejected`; only in
    /// `pose3d-smooth.jsonl`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub states: BTreeMap<String, String>,
    /// Height of the person when standing upright, from the lengths of the bones, in metres; `None` if too few lengths are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
    /// [`FrameLine::OK`], or the reason why there is no skeleton.
    pub status: String,
    /// Views from which at least one joint was triangulated.
    pub views_used: Vec<String>,
}

impl FrameLine {
    /// Name of the file of lines whose joints were smoothed. Their status is [`FrameLine::OK`] if any joint has a position, measured
    /// or not. The positions have no `reprojection_px`.
    pub const SMOOTHED_FILE: &'static str = "pose3d-smooth.jsonl";
    /// Status of a frame with a skeleton.
    pub const OK: &'static str = "ok";
    /// Status of a frame without a result.
    pub const NO_RESULT: &'static str = "no result";

    /// Returns true if there is a result, with or without a skeleton.
    pub fn has_result(&self) -> bool {
        self.status != Self::NO_RESULT
    }

    /// Returns true if any person has a skeleton.
    pub fn has_pose(&self) -> bool {
        self.status == Self::OK
    }

    /// Returns the followed person; `None` if there is no person.
    pub fn followed(&self) -> Option<&PersonLine> {
        self.people.first()
    }
}

/// Reads the people, at most as many as are allowed. No two of them may have the same id.
fn people<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<PersonLine>, D::Error> {
    let people = Vec::<PersonLine>::deserialize(from)?;
    if people.len() > MOST_PEOPLE {
        let text = format!(
            "the frame has {} people, but at most {MOST_PEOPLE} are possible",
            people.len()
        );
        return Err(D::Error::custom(text));
    }
    for (nth, person) in people.iter().enumerate() {
        if person.id == 0 {
            return Err(D::Error::custom(
                "a person has the id 0, but ids begin at 1",
            ));
        }
        if people[..nth].iter().any(|other| other.id == person.id) {
            let text = format!(
                "two people have the id {}, but the ids in a frame must differ",
                person.id
            );
            return Err(D::Error::custom(text));
        }
    }
    Ok(people)
}

/// How certain left and right of a skeleton are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Left and right were not decided: they are named as they appear in the pictures.
    AsSeen,
    /// Left and right are certain.
    Sure,
    /// Left and right were decided on too little evidence.
    Unsure,
}

/// Poses from which a skeleton was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kept {
    /// The poses that fusion solved for.
    Solved,
    /// The single-view poses from which fusion started, because they agree better.
    Start,
}

/// A joint of a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "AnyJoint")]
pub enum JointLine {
    /// The joint has a position.
    Placed(PlacedJoint),
    /// The joint has no position.
    Missing {
        /// Reason why the joint has no position.
        status: String,
    },
}

/// A joint with a position.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlacedJoint {
    /// Covariance of the position, in square metres: xx, xy, xz, yy, yz, zz. NaN if it is not known.
    pub covariance_m2: [f64; 6],
    /// Position in the world, in metres.
    pub position_m: [f64; 3],
    /// Root mean square distance from the observations of the views, in pixels of their frames; `None` if it is not known.
    pub reprojection_px: Option<f64>,
    /// Views from which the joint was triangulated.
    pub views: Vec<String>,
}

impl JointLine {
    /// Returns the joint, if it has a position.
    pub fn placed(&self) -> Option<&PlacedJoint> {
        match self {
            Self::Placed(it) => Some(it),
            Self::Missing { .. } => None,
        }
    }
}

/// The fields of both kinds of joints.
#[derive(Deserialize)]
struct AnyJoint {
    status: Option<String>,
    covariance_m2: Option<Covariance>,
    position_m: Option<[f64; 3]>,
    /// The field may be null, so serde does not notice if it is missing.
    reprojection_px: Option<f64>,
    views: Option<Vec<String>>,
}

#[derive(Deserialize)]
struct Covariance(#[serde(deserialize_with = "numbers")] [f64; 6]);

impl TryFrom<AnyJoint> for JointLine {
    type Error = String;

    fn try_from(any: AnyJoint) -> Result<Self, String> {
        if let Some(status) = any.status {
            return Ok(Self::Missing { status });
        }
        let missing = |field: &str| {
            format!("missing field `{field}`, which a joint without `status` must have")
        };
        Ok(Self::Placed(PlacedJoint {
            covariance_m2: any.covariance_m2.ok_or_else(|| missing("covariance_m2"))?.0,
            position_m: any.position_m.ok_or_else(|| missing("position_m"))?,
            reprojection_px: any.reprojection_px,
            views: any.views.ok_or_else(|| missing("views"))?,
        }))
    }
}
