//! A person of a file, and why a file cannot be read.

use crate::decode::Keypoint;
use crate::files::names::{NameSet, NamesError};

/// Most people of a frame.
pub const MAX_PEOPLE: usize = 1000;
/// Most frames of a file, by their numbers.
pub const MAX_FRAMES: u64 = 10_000_000;
/// Farthest from the top-left pixel that a keypoint can lie, pixels.
const FARTHEST_PX: f64 = 1e6;

/// The keypoints of one person, as another program saw them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SeenKeypoints {
    /// In the order of the names: the place, pixels of the footage with the centre of the top-left pixel at (0, 0), and a score
    /// from 0 to 1. `None` for a keypoint that was not found, or not labelled.
    pub keypoints: Vec<Option<Keypoint>>,
}

impl SeenKeypoints {
    /// The box around the keypoints that were found with a score above 0: left, top, right, bottom, pixels.
    pub fn outline(&self) -> Option<[f64; 4]> {
        crate::window::outline(&self.keypoints)
    }
}

/// Why a file of keypoints cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It is not JSON of the layout.
    #[error("expected {layout}: {source}")]
    Json {
        /// The layout.
        layout: &'static str,
        /// Why, and where.
        source: serde_json::Error,
    },
    /// It is not JSON at all.
    #[error(
        "begins with {begin:?}, expected JSON; tables, such as those of DeepLabCut, are not read"
    )]
    NotJson {
        /// Its first letters.
        begin: String,
    },
    /// A list has a wrong number of numbers.
    #[error("`{entry}` has {got} numbers, expected {expected}")]
    Length {
        /// The list.
        entry: String,
        /// How many it has.
        got: usize,
        /// How many are read.
        expected: String,
    },
    /// A number is out of range.
    #[error("number {index} of `{entry}` is {value}, expected {expected}")]
    Number {
        /// The list.
        entry: String,
        /// Which of its numbers, from 0.
        index: usize,
        /// Value in the file.
        value: f64,
        /// Description of the values that are accepted.
        expected: String,
    },
    /// The number of keypoints does not identify a set.
    #[error(
        "`{entry}` has {n} keypoints; 17, 18, 25, 26, 133, 135 or 136 say what they are called by their number: else give `keypoint_names`, \
         one of {}",
        NameSet::known_sets().join(", ")
    )]
    UnknownSet {
        /// The list.
        entry: String,
        /// Number of keypoints.
        n: usize,
    },
    /// People have keypoints, but not of the body, or under another key.
    #[error(
        "`{entry}` has no `pose_keypoints_2d` with keypoints of the body in the picture, but {}",
        .keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
    )]
    OtherKeys {
        /// The person.
        entry: String,
        /// Keys of the file.
        keys: Vec<String>,
    },
    /// The names of the keypoints cannot be used.
    #[error("`{entry}`: {source}")]
    Names {
        /// The list of names.
        entry: String,
        /// Why.
        source: NamesError,
    },
    /// There are too many of something.
    #[error("{got} {what}, at most {most} are read")]
    TooMany {
        /// Kind of item.
        what: String,
        /// How many.
        got: u64,
        /// How many are read.
        most: u64,
    },
    /// Something else is wrong with an entry.
    #[error("`{entry}` is {got}, expected {expected}")]
    Entry {
        /// The entry.
        entry: String,
        /// Entry in the file.
        got: String,
        /// Description of the values that are accepted.
        expected: String,
    },
}

/// Refuses more than can be.
pub(crate) fn at_most(got: usize, most: usize, what: &str) -> Result<(), FileError> {
    if got <= most {
        return Ok(());
    }
    Err(FileError::TooMany {
        what: what.to_owned(),
        got: got as u64,
        most: most as u64,
    })
}

/// A person of a list of numbers: column, row and a third one for every keypoint. A keypoint with a number that is not there was not
/// found. No numbers at all are a person without keypoints; those after the named keypoints are not read.
///
/// * `entry`: the list, for errors.
/// * `is_found`: whether three numbers are a keypoint that was found.
pub(crate) fn person(
    values: &[Option<f64>],
    names: &NameSet,
    entry: impl Fn() -> String,
    is_found: fn([f64; 3]) -> bool,
) -> Result<SeenKeypoints, FileError> {
    let n = names.n();
    if values.is_empty() {
        return Ok(SeenKeypoints {
            keypoints: vec![None; n],
        });
    }
    let in_file = names.n_in_file();
    if values.len() != 3 * in_file {
        return Err(FileError::Length {
            entry: entry(),
            got: values.len(),
            expected: format!("{}: 3 for each of {in_file} keypoints", 3 * in_file),
        });
    }
    let values = &values[..3 * n];
    for (index, value) in values.iter().enumerate() {
        let value = value.unwrap_or(0.0);
        if !(-FARTHEST_PX..=FARTHEST_PX).contains(&value) {
            return Err(FileError::Number {
                entry: entry(),
                index,
                value,
                expected: format!("{} to {FARTHEST_PX}", -FARTHEST_PX),
            });
        }
    }
    let keypoint = |triple: &[Option<f64>; 3]| {
        let [Some(x), Some(y), Some(third)] = *triple else {
            return None;
        };
        is_found([x, y, third]).then_some(Keypoint {
            at: [x, y],
            score: third.clamp(0.0, 1.0),
        })
    };
    let (triples, _) = values.as_chunks::<3>();
    Ok(SeenKeypoints {
        keypoints: triples.iter().map(keypoint).collect(),
    })
}

/// The set of names that follows from the number of values.
pub(crate) fn told_by(n_values: usize, entry: impl Fn() -> String) -> Result<NameSet, FileError> {
    if !n_values.is_multiple_of(3) {
        return Err(FileError::Length {
            entry: entry(),
            got: n_values,
            expected: "3 for each keypoint".to_owned(),
        });
    }
    let n = n_values / 3;
    NameSet::of_number(n).ok_or_else(|| FileError::UnknownSet { entry: entry(), n })
}
