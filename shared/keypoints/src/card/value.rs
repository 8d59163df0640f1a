//! Conversion of the numbers of a map to a position and a score.

use serde::{Deserialize, Serialize};

/// How the position of a maximum of a map is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refine {
    /// The position is not refined.
    None,
    /// The position is moved by a quarter of a cell towards the higher neighbour.
    #[default]
    Quarter,
    /// The position is that of the maximum of a parabola through the logarithms (DARK: Zhang et al. 2020, without its smoothing).
    Parabola,
}

/// Meaning of a score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Score {
    /// The value is a score from 0 to 1.
    #[default]
    Share,
    /// The value is log-odds, whose logistic function is the score.
    LogOdds,
}

impl Score {
    /// Converts a value of the output to a score.
    pub fn of(self, value: f64) -> f64 {
        match self {
            Self::Share => value,
            Self::LogOdds => 1.0 / (1.0 + (-value).exp()),
        }
    }
}
