//! The file, stored beside a model, that defines the positions of joints relative to the model's parts.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use skeleton::{JointMap, JointSet, N_PARTS, PARSE14};

use crate::learned::local::own;

/// The format name of a file of joints.
const FORMAT: &str = "parallax-joints";
/// The version that is written, and the only version that can be read.
const VERSION: u32 = 1;
/// Maximum absolute value of a weight.
const MOST: f64 = 10.0;
/// Maximum difference of the sum of a row from 1.
const SUM_TOLERANCE: f64 = 1e-6;

/// Positions of the joints of `skeleton::PARSE14` relative to the parts of one model.
///
/// The file is a single JSON object; all fields are required, and unknown fields are rejected.
///
/// | field | content |
/// |---|---|
/// | `format`, `version` | `"parallax-joints"`, 1 |
/// | `model` | 16 hexadecimal digits: FNV-1a of the model file with which the joints were learned |
/// | `joints` | the joints: `name`, in the order of `parse14`, and `weights`, one per part of the model, which sum to 1 |
/// | `learned` | settings and results of the learning: `reach`, `ridge`, and for every data set (`sets`) its `name`, the number of `people`, the number of people `found`, and the mean error before and after (`error_before`, `error_after`). Errors are in percent of the person's size, are limited to 10 each, and are measured on people who were left out in turn |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointFile {
    /// The format name, `parallax-joints`.
    pub format: String,
    /// The format version, 1.
    pub version: u32,
    /// Fingerprint of the model file.
    pub model: String,
    /// Weights of every joint.
    pub joints: Vec<JointRow>,
    /// Settings and results of the learning.
    pub learned: JointsLearned,
}

/// A joint as a weighted sum of parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRow {
    /// Name of the joint.
    pub name: String,
    /// Weights, one for each part.
    pub weights: Vec<f64>,
}

/// Settings and results of the learning of joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointsLearned {
    /// Maximum number of bones between a joint's own part and a part that determines its position.
    pub reach: usize,
    /// Cost of a weight on parts other than the joint's own.
    pub ridge: f64,
    /// The data sets from which the joints were learned.
    pub sets: Vec<LearnedSet>,
}

/// A data set from which joints were learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedSet {
    /// Name of the data set.
    pub name: String,
    /// Number of people.
    pub people: u64,
    /// Number of people who were found.
    pub found: u64,
    /// Mean error if the joints are taken to be the parts themselves.
    pub error_before: f64,
    /// Mean error of the joints on people who were left out of the learning.
    pub error_after: f64,
}

/// Reason why a text was rejected as a file of joints.
#[derive(Debug, thiserror::Error)]
pub enum JointFileError {
    /// The text is not JSON with the expected fields.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// The text has another format or another version.
    #[error("`{format}` version {version}, expected `{FORMAT}` version {VERSION}")]
    Version {
        /// Format name in the text.
        format: String,
        /// Version in the text.
        version: u32,
    },
    /// A value is out of range or has the wrong size.
    #[error("`{field}` is not {expected}")]
    Value {
        /// Name of the field.
        field: String,
        /// The expected value.
        expected: String,
    },
}

impl JointFile {
    /// Creates a file from the rows returned by [`Local::learn`](crate::learned::Local::learn).
    ///
    /// * `model`: fingerprint of the model file.
    pub fn new(model: String, rows: Vec<Vec<f64>>, learned: JointsLearned) -> Self {
        let joints = PARSE14.joints.iter().zip(rows);
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            model,
            joints: joints
                .map(|(joint, weights)| JointRow {
                    name: joint.name.to_owned(),
                    weights,
                })
                .collect(),
            learned,
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    ///
    /// [`JointFileError`], naming the field.
    pub fn parse(text: &str) -> Result<Self, JointFileError> {
        let head: Head = serde_json::from_str(text)?;
        if head.format != FORMAT || head.version != VERSION {
            return Err(JointFileError::Version {
                format: head.format.chars().take(32).collect(),
                version: head.version,
            });
        }
        let read: Self = serde_json::from_str(text)?;
        read.check()?;
        Ok(read)
    }

    /// Writes the text that [`Self::parse`] reads, with one joint per line.
    ///
    /// # Errors
    ///
    /// [`JointFileError::Json`] for numbers that JSON cannot represent.
    pub fn write(&self) -> Result<String, JointFileError> {
        let joints: Result<Vec<_>, _> = self.joints.iter().map(serde_json::to_string).collect();
        Ok(format!(
            "{{\"format\":\"{FORMAT}\",\"version\":{VERSION},\"model\":{},\n\"learned\":{},\n\"joints\":[\n{}\n]}}\n",
            serde_json::to_string(&self.model)?,
            serde_json::to_string(&self.learned)?,
            joints?.join(",\n")
        ))
    }

    /// Returns the map from the 26 parts to the joints of a set. All joints of the set must be made of joints of `skeleton::PARSE14`.
    ///
    /// * Returns `None` for a set with a part that is not a joint of `skeleton::PARSE14`.
    pub fn map(&self, set: &JointSet) -> Option<Arc<JointMap>> {
        let of_part = |part: &usize| {
            let joint = (0..self.joints.len()).find(|i| own(*i) == *part)?;
            Some(&self.joints[joint].weights)
        };
        let of_joint = |joint: &skeleton::Joint| -> Option<Vec<f64>> {
            let rows: Option<Vec<&Vec<f64>>> = joint.parts.iter().map(of_part).collect();
            let rows = rows?;
            let mean =
                |part: usize| rows.iter().map(|row| row[part]).sum::<f64>() / rows.len() as f64;
            Some((0..N_PARTS).map(mean).collect())
        };
        let rows: Option<Vec<_>> = set.joints.iter().map(of_joint).collect();
        JointMap::new(rows?).map(Arc::new)
    }

    fn check(&self) -> Result<(), JointFileError> {
        let is_hex = |letter: char| letter.is_ascii_digit() || ('a'..='f').contains(&letter);
        let is_fingerprint = self.model.len() == 16 && self.model.chars().all(is_hex);
        demand(is_fingerprint, "model", "16 hexadecimal digits")?;
        let n = PARSE14.joints.len();
        demand(self.joints.len() == n, "joints", &format!("{n} joints"))?;
        for (nth, (joint, known)) in self.joints.iter().zip(PARSE14.joints).enumerate() {
            let name = format!("joints[{nth}].name");
            demand(
                joint.name == known.name,
                &name,
                &format!("{:?}", known.name),
            )?;
            let (weights, field) = (&joint.weights, format!("joints[{nth}].weights"));
            let is_row =
                weights.len() == N_PARTS && weights.iter().all(|weight| weight.abs() <= MOST);
            let expected = format!("{N_PARTS} numbers from -{MOST} to {MOST}");
            demand(is_row, &field, &expected)?;
            let sum: f64 = weights.iter().sum();
            demand(
                (sum - 1.0).abs() <= SUM_TOLERANCE,
                &field,
                "a row whose sum is 1",
            )?;
        }
        let it = &self.learned;
        demand(
            in_range(it.ridge),
            "learned.ridge",
            "a number of at least 0",
        )?;
        demand(
            it.reach <= N_PARTS,
            "learned.reach",
            &format!("at most {N_PARTS}"),
        )?;
        for (nth, set) in it.sets.iter().enumerate() {
            let field = |name: &str| format!("learned.sets[{nth}].{name}");
            demand(set.found <= set.people, &field("found"), "at most `people`")?;
            for (name, error) in [
                ("error_before", set.error_before),
                ("error_after", set.error_after),
            ] {
                demand(in_range(error), &field(name), "a number of at least 0")?;
            }
        }
        Ok(())
    }
}

#[derive(Deserialize)]
struct Head {
    format: String,
    version: u32,
}

fn demand(holds: bool, field: &str, expected: &str) -> Result<(), JointFileError> {
    if holds {
        return Ok(());
    }
    Err(JointFileError::Value {
        field: field.to_owned(),
        expected: expected.to_owned(),
    })
}

fn in_range(number: f64) -> bool {
    number.is_finite() && number >= 0.0
}
