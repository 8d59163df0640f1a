//! The file with learned consistency of views.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Learned consistency between views.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"shipped\", a file, or { file = \"...\", rig = \"...\" }"
)]
pub enum Consistency {
    /// A file whose part-type tables are chosen by the angle between two cameras.
    File(PathBuf),
    /// A file, and the rig in it that has the cameras of this deployment.
    Rig(RigConsistency),
}

/// A file, and a rig that it was trained with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigConsistency {
    /// File with the learned consistency.
    pub file: PathBuf,
    /// Name of the rig in the file.
    pub rig: String,
}

impl Consistency {
    /// Returns the file.
    pub fn file(&self) -> &PathBuf {
        match self {
            Self::File(file) => file,
            Self::Rig(of_rig) => &of_rig.file,
        }
    }

    /// Returns the name of the rig that has these cameras, if the deployment file gives it.
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
