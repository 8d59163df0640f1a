//! Annotated people, and the faults of annotations.

use std::path::PathBuf;

use footage::{FootageError, Size};

/// One annotated person.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Path of the image.
    pub image: PathBuf,
    /// Position of the row in the data set, as text for messages.
    pub row: String,
    /// The joints, `[x, y]` in pixels, with the centre of the top-left pixel at `(0, 0)`. Unknown joints
    /// are NaN; they occur only if [`ReadOptions::unknown_joints`](crate::datasets::ReadOptions) is set.
    pub joints: Vec<[f64; 2]>,
    /// For each joint, true if it is visible according to the annotation.
    pub visible: Vec<bool>,
}

/// The valid people of a data set, and the problems of the people left out.
#[derive(Debug, Default)]
pub struct People {
    /// Valid people, in the order of the data set.
    pub people: Vec<Person>,
    /// A problem for each person that was left out because of a fault, in the order of the data set.
    pub problems: Vec<Problem>,
}

impl People {
    /// Number of problems of each kind that occurs.
    pub fn counts(&self) -> Vec<(FaultKind, usize)> {
        FaultKind::ALL
            .into_iter()
            .map(|kind| {
                let of_kind = |problem: &&Problem| problem.fault.kind() == kind;
                (kind, self.problems.iter().filter(of_kind).count())
            })
            .filter(|(_, count)| *count > 0)
            .collect()
    }
}

/// A person with a fault.
#[derive(Debug, thiserror::Error)]
#[error("{}, {row}", file.display())]
pub struct Problem {
    /// The annotation file.
    pub file: PathBuf,
    /// Position of the person in the file.
    pub row: String,
    /// The fault.
    #[source]
    pub fault: Fault,
}

/// The fault of a person. Joints are numbered from 1.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The line does not describe a person.
    #[error("not a person: {message}")]
    Syntax {
        /// Message of the JSON parser.
        message: String,
    },
    /// More or fewer joints than the skeleton has.
    #[error("{got} {what}, expected {expected}")]
    Count {
        /// The entries that were counted: joints, or visibility flags.
        what: &'static str,
        /// Number of entries found.
        got: usize,
        /// Number of entries expected.
        expected: usize,
    },
    /// A joint is unknown: `null` in JSON lines, both coordinates NaN in other files.
    #[error("joint {joint} is unknown")]
    Unknown {
        /// Number of the joint, from 1.
        joint: usize,
    },
    /// A coordinate is infinite, or one of the two is NaN.
    #[error("joint {joint} is at ({}, {}), expected two finite numbers", at[0], at[1])]
    NotFinite {
        /// Number of the joint, from 1.
        joint: usize,
        /// Coordinates of the joint.
        at: [f64; 2],
    },
    /// All joints are at the same position.
    #[error("all joints are within {extent_px:.3} px of ({:.1}, {:.1})", at[0], at[1])]
    ZeroSize {
        /// Centre of the joints, in pixels.
        at: [f64; 2],
        /// Longer side of the rectangle around the joints, in pixels.
        extent_px: f64,
    },
    /// The image is missing, empty or damaged.
    #[error("the image cannot be used")]
    Image(#[from] FootageError),
    /// A joint is outside the image.
    #[error(
        "joint {joint} at ({:.1}, {:.1}) is {by_px:.1} px outside the image of {size}, more than {limit_px}",
        at[0], at[1]
    )]
    Outside {
        /// Number of the joint farthest outside, from 1.
        joint: usize,
        /// Position of the joint, in pixels.
        at: [f64; 2],
        /// Size of the image.
        size: Size,
        /// Distance beyond the border, in pixels.
        by_px: f64,
        /// Accepted distance, in pixels.
        limit_px: f64,
    },
    /// An earlier person has the same joints on the same image.
    #[error("the same image and joints as {before}")]
    Twice {
        /// Position of the first occurrence in the data set.
        before: String,
    },
    /// Another person has the same name.
    #[error("the name {name:?} is already used in {before}")]
    SameName {
        /// The duplicate name.
        name: String,
        /// Position of the first person with that name.
        before: String,
    },
}

impl Fault {
    /// Kind of the fault.
    pub fn kind(&self) -> FaultKind {
        match self {
            Self::Syntax { .. } => FaultKind::Syntax,
            Self::Count { .. } => FaultKind::Count,
            Self::Unknown { .. } => FaultKind::Unknown,
            Self::NotFinite { .. } => FaultKind::NotFinite,
            Self::ZeroSize { .. } => FaultKind::ZeroSize,
            Self::Image(_) => FaultKind::Image,
            Self::Outside { .. } => FaultKind::Outside,
            Self::Twice { .. } => FaultKind::Twice,
            Self::SameName { .. } => FaultKind::SameName,
        }
    }
}

/// Kinds of [`Fault`]. They are used to count faults, and to choose the faults that make reading fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// [`Fault::Syntax`]
    Syntax,
    /// [`Fault::Count`]
    Count,
    /// [`Fault::Unknown`]
    Unknown,
    /// [`Fault::NotFinite`]
    NotFinite,
    /// [`Fault::ZeroSize`]
    ZeroSize,
    /// [`Fault::Image`]
    Image,
    /// [`Fault::Outside`]
    Outside,
    /// [`Fault::Twice`]
    Twice,
    /// [`Fault::SameName`]
    SameName,
}

impl FaultKind {
    /// All kinds of faults.
    pub const ALL: [Self; 9] = [
        Self::Syntax,
        Self::Count,
        Self::Unknown,
        Self::NotFinite,
        Self::ZeroSize,
        Self::Image,
        Self::Outside,
        Self::Twice,
        Self::SameName,
    ];

    /// Name of the kind on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Syntax => "syntax",
            Self::Count => "count",
            Self::Unknown => "unknown",
            Self::NotFinite => "not-finite",
            Self::ZeroSize => "zero-size",
            Self::Image => "image",
            Self::Outside => "outside",
            Self::Twice => "twice",
            Self::SameName => "same-name",
        }
    }

    /// Returns the kind with a given name, if there is one.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl std::fmt::Display for FaultKind {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_data_set_is_found_by_its_name() {
        for kind in FaultKind::ALL {
            assert_eq!(FaultKind::by_name(kind.name()), Some(kind));
        }
        assert_eq!(FaultKind::by_name("other"), None);
    }
}
