//! A person of a file, and the reasons why a file cannot be read.

use crate::decode::Keypoint;
use crate::files::names::{NameSet, NamesError};

/// Maximum number of people of a frame.
pub const MAX_PEOPLE: usize = 1000;
/// Maximum number of frames of a file, according to their numbers.
pub const MAX_FRAMES: u64 = 10_000_000;
/// Maximum distance of a keypoint from the top-left pixel, in pixels.
const FARTHEST_PX: f64 = 1e6;

/// The keypoints of one person, as another program found them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SeenKeypoints {
    /// Keypoints in the order of the names. Each has a position, in pixels of the footage with the centre of the top-left pixel at (0, 0),
    /// and a score from 0 to 1. `None` for a keypoint that was not found, or not labelled.
    pub keypoints: Vec<Option<Keypoint>>,
}

impl SeenKeypoints {
    /// Returns the box around the keypoints that were found with a score above 0: left, top, right, bottom, in pixels.
    pub fn outline(&self) -> Option<[f64; 4]> {
        crate::window::outline(&self.keypoints)
    }
}

/// Reason why a file of keypoints cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The text is not JSON with the expected layout.
    #[error("expected {layout}: {source}")]
    Json {
        /// Description of the layout.
        layout: &'static str,
        /// Cause and position of the error.
        source: serde_json::Error,
    },
    /// The text is not JSON at all.
    #[error(
        "the file begins with {begin:?}, expected JSON; tables, such as DeepLabCut's, cannot be read"
    )]
    NotJson {
        /// First letters of the text.
        begin: String,
    },
    /// A list has a wrong number of values.
    #[error("`{entry}` has {got} numbers, expected {expected}")]
    Length {
        /// Name of the list.
        entry: String,
        /// Number of values in the list.
        got: usize,
        /// Expected number of values.
        expected: String,
    },
    /// A number is out of range.
    #[error("number {index} of `{entry}` is {value}, expected {expected}")]
    Number {
        /// Name of the list.
        entry: String,
        /// Index of the value in the list, counted from 0.
        index: usize,
        /// Value in the file.
        value: f64,
        /// Description of the values that are accepted.
        expected: String,
    },
    /// The number of keypoints does not identify a set.
    #[error(
        "`{entry}` has {n} keypoints, but their names are known only for 17, 18, 25, 26, 133, 135 or 136 keypoints: set `keypoint_names` \
         to one of {}",
        NameSet::known_sets().join(", ")
    )]
    UnknownSet {
        /// Name of the list.
        entry: String,
        /// Number of keypoints.
        n: usize,
    },
    /// A person has keypoints, but none of the body, or only under another key.
    #[error(
        "`{entry}` has no `pose_keypoints_2d` with keypoints of the body in the picture; it has only {}",
        .keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
    )]
    OtherKeys {
        /// Name of the person's entry.
        entry: String,
        /// Keys of the file.
        keys: Vec<String>,
    },
    /// The names of the keypoints cannot be used.
    #[error("`{entry}`: {source}")]
    Names {
        /// Name of the list of names.
        entry: String,
        /// Cause of the error.
        source: NamesError,
    },
    /// There are too many items of some kind.
    #[error("the file has {got} {what}, but at most {most} can be read")]
    TooMany {
        /// Kind of item.
        what: String,
        /// Number of items.
        got: u64,
        /// Maximum number of items that are read.
        most: u64,
    },
    /// Another problem with an entry.
    #[error("`{entry}` is {got}, expected {expected}")]
    Entry {
        /// Name of the entry.
        entry: String,
        /// Content of the entry in the file.
        got: String,
        /// Description of the values that are accepted.
        expected: String,
    },
}

/// Returns an error if the number of items is above the maximum.
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

/// Returns the person of a list of numbers, which has column, row and a third number for every keypoint. A keypoint with a missing number
/// was not found. An empty list is a person without keypoints. Numbers after the named keypoints are not read.
///
/// * `entry`: function that returns the name of the list, for errors.
/// * `is_found`: function that returns true if the three numbers are those of a keypoint that was found.
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
            expected: format!("{} numbers, 3 for each of {in_file} keypoints", 3 * in_file),
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

/// Returns the set of names for the given number of values.
pub(crate) fn told_by(n_values: usize, entry: impl Fn() -> String) -> Result<NameSet, FileError> {
    if !n_values.is_multiple_of(3) {
        return Err(FileError::Length {
            entry: entry(),
            got: n_values,
            expected: "3 numbers for each keypoint".to_owned(),
        });
    }
    let n = n_values / 3;
    NameSet::of_number(n).ok_or_else(|| FileError::UnknownSet { entry: entry(), n })
}
