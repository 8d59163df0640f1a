//! `pose3d.jsonl`: a line for every frame, its skeleton or why there is none.

use std::collections::BTreeMap;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::Missing;
use crate::nullable::{nullable, numbers};

/// Most people of a line.
pub const MOST_PEOPLE: usize = 8;

/// A line of `pose3d.jsonl`, and of `pose3d-smooth.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameLine {
    /// Number of the frame in the footage.
    pub frame: u64,
    /// The people, each with an identity of its own, the followed person first; none in a line without a result.
    #[serde(deserialize_with = "people")]
    pub people: Vec<PersonLine>,
    /// Why there is no result; only in a line without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// How many people the views agree on, whether or not they are in the list; none in a line without a result, and where the model is
    /// not of people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<u32>,
    /// [`FrameLine::OK`] if anybody has a skeleton, [`FrameLine::NO_RESULT`], or why nobody has.
    pub status: String,
    /// When the frame was taken, seconds after frame 0 of the footage, where its rate is known.
    #[serde(deserialize_with = "nullable")]
    pub time_s: Option<f64>,
    /// The views that have no part in the result.
    pub views_missing: BTreeMap<String, Missing>,
    /// The views that have a part in the result.
    pub views_present: Vec<String>,
}

/// A person of a line.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PersonLine {
    /// How much the lengths of the bones differ from those of people, standard deviations; none where there is no body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_deviation: Option<f64>,
    /// Amount by which the decision which views see the person from the same side was won; none where it was
    /// not made.
    #[serde(deserialize_with = "nullable")]
    pub facing_margin: Option<f64>,
    /// Identity within the run, from 1.
    pub id: u64,
    /// The joints, by name.
    pub joints: BTreeMap<String, JointLine>,
    /// Poses that the skeleton is made of: those that fusion solved for, or those that it started from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Kept>,
    /// Keypoints of networks beside the joints (face, feet, hands), by name, each triangulated alone. Empty without such
    /// networks.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub keypoints: BTreeMap<String, JointLine>,
    /// Pairs of views that have a part in the skeleton.
    pub pairs: u32,
    /// Certainty of left and right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<Sides>,
    /// Log-odds that left and right are not exchanged in all views, nats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides_margin: Option<f64>,
    /// State of every joint and keypoint with a position: `measured`, `exchanged`, `filled` or `rejected`; only in
    /// `pose3d-smooth.jsonl`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub states: BTreeMap<String, String>,
    /// Height of the person standing upright, by the lengths of the bones, metres; none where too few are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stature_m: Option<f64>,
    /// [`FrameLine::OK`], or why there is no skeleton.
    pub status: String,
    /// The views that some joint was triangulated from.
    pub views_used: Vec<String>,
}

impl FrameLine {
    /// Name of the file of lines whose joints were smoothed. Their status is [`FrameLine::OK`] where any joint has a position, measured
    /// or not; positions have no `reprojection_px`.
    pub const SMOOTHED_FILE: &'static str = "pose3d-smooth.jsonl";
    /// Status of a frame with a skeleton.
    pub const OK: &'static str = "ok";
    /// Status of a frame without a result.
    pub const NO_RESULT: &'static str = "no result";

    /// Returns true if there is a result, with a skeleton or without.
    pub fn has_result(&self) -> bool {
        self.status != Self::NO_RESULT
    }

    /// Returns true if anybody has a skeleton.
    pub fn has_pose(&self) -> bool {
        self.status == Self::OK
    }

    /// The followed person; `None` if there is nobody.
    pub fn followed(&self) -> Option<&PersonLine> {
        self.people.first()
    }
}

/// Reads at most as many people as fit, no two with one identity.
fn people<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<PersonLine>, D::Error> {
    let people = Vec::<PersonLine>::deserialize(from)?;
    if people.len() > MOST_PEOPLE {
        let text = format!("{} people, a frame has at most {MOST_PEOPLE}", people.len());
        return Err(D::Error::custom(text));
    }
    for (nth, person) in people.iter().enumerate() {
        if person.id == 0 {
            return Err(D::Error::custom("a person with id 0, ids begin at 1"));
        }
        if people[..nth].iter().any(|other| other.id == person.id) {
            let text = format!("two people with id {}, ids of a frame differ", person.id);
            return Err(D::Error::custom(text));
        }
    }
    Ok(people)
}

/// Certainty of left and right of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// They are not decided, but those of the pictures.
    AsSeen,
    /// They are certain.
    Sure,
    /// Too little speaks for them.
    Unsure,
}

/// Which poses a skeleton is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kept {
    /// Those that fusion solved for.
    Solved,
    /// The single-view poses that it started from, which agree better.
    Start,
}

/// A joint of a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "AnyJoint")]
pub enum JointLine {
    /// It has a position.
    Placed(PlacedJoint),
    /// It has none.
    Missing {
        /// Why.
        status: String,
    },
}

/// A joint with a position.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlacedJoint {
    /// Covariance of the position, square metres: xx, xy, xz, yy, yz, zz. NaN where it is not known.
    pub covariance_m2: [f64; 6],
    /// In the world, metres.
    pub position_m: [f64; 3],
    /// Root mean square distance to what the views found, pixels of their frames; none where it is not known.
    pub reprojection_px: Option<f64>,
    /// The views that it was triangulated from.
    pub views: Vec<String>,
}

impl JointLine {
    /// The joint, if it has a position.
    pub fn placed(&self) -> Option<&PlacedJoint> {
        match self {
            Self::Placed(it) => Some(it),
            Self::Missing { .. } => None,
        }
    }
}

/// The fields of either kind.
#[derive(Deserialize)]
struct AnyJoint {
    status: Option<String>,
    covariance_m2: Option<Covariance>,
    position_m: Option<[f64; 3]>,
    /// May be null, so that it may not be missing is not checked.
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
