//! The origin of an example, from which it can be recomputed.

use fmp::{Placement, Pose};
use serde::{Deserialize, Serialize};

use crate::shape::Shape;

/// A stored pose: level, and `(x, y, type)` of every part.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct Placed {
    level: u16,
    parts: Vec<(u16, u16, u8)>,
}

impl Placed {
    /// Converts a pose, without its score.
    pub(crate) fn of(pose: &Pose) -> Self {
        let part = |placement: &Placement| (placement.x, placement.y, placement.mixture);
        Self {
            level: pose.level,
            parts: pose.parts.iter().map(part).collect(),
        }
    }

    /// Returns true if the pose has the parts and types of a shape.
    pub(crate) fn fits(&self, shape: &Shape) -> bool {
        let has_type =
            |(part, it): (usize, &(u16, u16, u8))| usize::from(it.2) < shape.n_types(part);
        self.parts.len() == shape.n_parts() && self.parts.iter().enumerate().all(has_type)
    }

    /// Converts to a pose with a score of 0.
    pub(crate) fn pose(&self) -> Pose {
        let part = |&(x, y, mixture): &(u16, u16, u8)| Placement { x, y, mixture };
        Pose {
            score: 0.0,
            level: self.level,
            parts: self.parts.iter().map(part).collect(),
        }
    }
}

/// The origin of an example. People have the same numbers as in the [`Plan`](crate::Plan).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum Origin {
    /// The right pose of a person.
    Right {
        /// Number of the person.
        person: u32,
        /// The right pose.
        pose: Placed,
    },
    /// The difference between the right pose of a person and a wrong pose.
    Mistake {
        /// Number of the person.
        person: u32,
        /// The wrong pose.
        pose: Placed,
    },
    /// A pose found in an image without people.
    Background {
        /// Number of the image.
        image: u32,
        /// The pose found there.
        pose: Placed,
    },
}

/// Group of examples in which only the worst example counts.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Group {
    /// The right pose of a person.
    Right(u32),
    /// The wrong poses of a person.
    Mistakes(u32),
    /// Image, level, row and column of the root in an image without people.
    Background(u32, u16, u16, u16),
}

impl Origin {
    /// The pose of the example.
    pub(crate) fn pose(&self) -> &Placed {
        match self {
            Self::Right { pose, .. }
            | Self::Mistake { pose, .. }
            | Self::Background { pose, .. } => pose,
        }
    }

    /// Returns two values: true if the image of the example shows a person, and the number of the image.
    pub(crate) fn source(&self) -> (bool, u32) {
        match self {
            Self::Right { person, .. } | Self::Mistake { person, .. } => (true, *person),
            Self::Background { image, .. } => (false, *image),
        }
    }

    /// The group to which the example belongs.
    pub(crate) fn group(&self) -> Group {
        match self {
            Self::Right { person, .. } => Group::Right(*person),
            Self::Mistake { person, .. } => Group::Mistakes(*person),
            Self::Background { image, pose } => {
                let (x, y, _) = pose.parts.first().copied().unwrap_or_default();
                Group::Background(*image, pose.level, y, x)
            }
        }
    }
}
