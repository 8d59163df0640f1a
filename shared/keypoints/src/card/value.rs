//! How the numbers of a map become a place and a score.

use serde::{Deserialize, Serialize};

/// How a maximum of a map is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refine {
    /// Not at all.
    None,
    /// By a quarter of a cell towards the higher neighbour.
    #[default]
    Quarter,
    /// To the maximum of a parabola through logarithms (DARK: Zhang et al. 2020, without its smoothing).
    Parabola,
}

/// Meaning of a score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Score {
    /// A number from 0 to 1.
    #[default]
    Share,
    /// Log-odds: its logistic function is the score.
    LogOdds,
}

impl Score {
    /// A value of the output as a score.
    pub fn of(self, value: f64) -> f64 {
        match self {
            Self::Share => value,
            Self::LogOdds => 1.0 / (1.0 + (-value).exp()),
        }
    }
}
