//! Section `[pose]` of a deployment file.

use pipeline::{EvidenceWindow, ViewSettings};
use serde::{Deserialize, Serialize};

/// The single-view solver, and what it hands on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Which levels of the pyramid are offered to fusion.
    pub evidence_window: Window,
    /// Most distinct candidates that a view offers.
    pub candidates: usize,
    /// Least mean distance between two candidates' part centres, in box sides.
    pub min_separation: f64,
    /// Threads of one pose process.
    pub threads: usize,
}

impl Default for Config {
    fn default() -> Self {
        let step = ViewSettings::default();
        Self {
            evidence_window: match step.window {
                EvidenceWindow::All => Window::All(All::All),
                EvidenceWindow::Around(reach) => Window::Levels(reach),
            },
            candidates: step.n_candidates,
            min_separation: step.min_separation,
            threads: 1,
        }
    }
}

impl Config {
    /// The settings of the single-view step.
    pub fn settings(&self) -> ViewSettings {
        ViewSettings {
            window: match self.evidence_window {
                Window::All(All::All) => EvidenceWindow::All,
                Window::Levels(reach) => EvidenceWindow::Around(reach),
            },
            n_candidates: self.candidates,
            min_separation: self.min_separation,
        }
    }
}

/// Levels of the pyramid around those of the candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number of levels, or \"all\"")]
pub enum Window {
    /// So many levels either side of every candidate's own.
    Levels(u16),
    /// All of them.
    All(All),
}

/// The word `all`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum All {
    /// Everything.
    All,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_step() {
        assert_eq!(Config::default().settings(), ViewSettings::default());
    }
}
