//! The file of what was learned about views that belong together.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Learned consistency of views that belong together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"shipped\", a file, or { file = \"...\", rig = \"...\" }"
)]
pub enum Consistency {
    /// A file, whose part-type tables go by the angle between two cameras.
    File(PathBuf),
    /// A file, and the rig whose cameras these are.
    Rig(RigConsistency),
}

/// A file and a rig that it was learned with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigConsistency {
    /// The file.
    pub file: PathBuf,
    /// Name of the rig in the file.
    pub rig: String,
}

impl Consistency {
    /// The file.
    pub fn file(&self) -> &PathBuf {
        match self {
            Self::File(file) => file,
            Self::Rig(of_rig) => &of_rig.file,
        }
    }

    /// The name of the rig whose cameras these are, if it is given.
    pub fn rig(&self) -> Option<&str> {
        match self {
            Self::File(_) => None,
            Self::Rig(of_rig) => Some(&of_rig.rig),
        }
    }

    pub(crate) fn file_mut(&mut self) -> &mut PathBuf {
        match self {
            Self::File(file) => file,
            Self::Rig(of_rig) => &mut of_rig.file,
        }
    }
}
