//! Section `[person]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The person whose skeleton comes out, and the joints that it has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Person")]
pub struct Config {
    /// Which of several people comes first: `last`, the one of the frame before; `largest` or `clearest`, chosen anew in every frame.
    pub follow: Follow,
    /// The set of joints: `parse14`, `umpm15` or `humaneva20`.
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
    /// The one nearest to where the person was in the frame before.
    #[default]
    Last,
    /// The largest in the pictures.
    Largest,
    /// The one that most views see most clearly.
    Clearest,
}

impl Follow {
    /// The word of the deployment file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Last => "last",
            Self::Largest => "largest",
            Self::Clearest => "clearest",
        }
    }
}
