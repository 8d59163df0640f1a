//! The people of a frame, and of all frames of a film.

use std::collections::BTreeMap;

use crate::files::names::NameSet;
use crate::files::seen::{FileError, SeenKeypoints, person, told_by};

/// The people of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Names of the people's keypoints; `None` if no person has keypoints and no names were given.
    pub names: Option<NameSet>,
    /// People in the order of the file. Without names, their lists are empty.
    pub people: Vec<SeenKeypoints>,
}

/// The people of all frames of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Names of the people's keypoints.
    pub names: NameSet,
    /// Number of frames: the number of images of a data set, or one more than the highest frame number of results.
    pub n_frames: u64,
    /// People of each frame, by number from 0, in the order of the file. A data set has all its frames. In results, frames
    /// without a person are missing.
    pub frames: BTreeMap<u64, Vec<SeenKeypoints>>,
}

/// Returns the people of lists of numbers.
///
/// * `entry`: function that returns the name of a person's list, for errors.
pub(super) fn people_of(
    lists: &[&[Option<f64>]],
    names: Option<&NameSet>,
    entry: impl Fn(usize) -> String,
) -> Result<Frame, FileError> {
    let told = lists.iter().enumerate().find(|list| !list.1.is_empty());
    let names = match (names, told) {
        (Some(names), _) => Some(names.clone()),
        (None, Some((nth, values))) => Some(told_by(values.len(), || entry(nth))?),
        (None, None) => None,
    };
    let read = |(nth, values): (usize, &&[Option<f64>])| match &names {
        Some(names) => person(
            values,
            names,
            || entry(nth),
            |keypoint| keypoint != [0.0; 3],
        ),
        None => Ok(SeenKeypoints::default()),
    };
    let people: Result<_, _> = lists.iter().enumerate().map(read).collect();
    Ok(Frame {
        people: people?,
        names,
    })
}
