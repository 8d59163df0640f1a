//! Section `[person]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The person to follow, and the joints of the resulting skeleton.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Person")]
pub struct Config {
    /// Which of several people is followed: `last`, the same person as in the previous frame; `largest` or `clearest`, chosen again in
    /// every frame.
    pub follow: Follow,
    /// Set of joints: `parse14`, `umpm15` or `humaneva20`.
    pub joints: String,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            follow: Follow::Last,
            joints: "parse14".to_owned(),
        }
    }
}

/// Which of several people is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Follow {
    /// The person nearest to the position in the previous frame.
    #[default]
    Last,
    /// The person who is largest in the pictures.
    Largest,
    /// The person who is seen clearly in the largest number of views.
    Clearest,
}

impl Follow {
    /// Returns the name of the value in a deployment file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Last => "last",
            Self::Largest => "largest",
            Self::Clearest => "clearest",
        }
    }
}
