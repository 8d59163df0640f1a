//! Section `[person]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whose skeleton comes out.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Person")]
pub struct Config {
    /// Which of several people: `last`, the one nearest to where the person was in the frame before, at first the one that
    /// most views see most clearly; `largest` in the pictures; `clearest`, in every frame anew. Every frame says how many
    /// people there are.
    pub follow: Follow,
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
