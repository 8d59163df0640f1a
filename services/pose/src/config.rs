//! Section `[pose]` of a deployment file.

use fmp::{Precision, TrackSettings};
use pipeline::{EvidenceWindow, ViewSettings};
use serde::{Deserialize, Serialize};

/// The single-view solver, and what it sends.
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
    /// How exactly the filters are evaluated.
    pub precision: Precision,
    /// Whether every frame is searched in full, or only near the last pose.
    pub search: Search,
    /// Tracked: levels either side of the last pose's that are searched.
    pub tracked_levels: u16,
    /// Tracked: how far around the last pose's box is searched, as a share of its longer side.
    pub tracked_margin: f64,
    /// Tracked: every n-th frame is searched in full.
    pub tracked_full_every: u64,
    /// Tracked: largest step from frame to frame that is followed.
    pub tracked_max_gap: u64,
    /// Tracked: fall of the score below that of the last full search that asks for another.
    pub tracked_max_drop: f32,
    /// Tracked: how far a pose may move in a second, as a share of its box's longer side.
    pub tracked_speed: f64,
    /// Tracked: longest time from frame to frame that is followed.
    pub tracked_max_gap_ms: f64,
    /// Tracked: a frame so long after the last full search is searched in full.
    pub tracked_full_every_ms: f64,
}

/// How a pose process looks for poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Search {
    /// Every frame on all levels and everywhere: the paper's method.
    #[default]
    Full,
    /// Near the best pose of the last frame, and in full now and then: faster, and approximate.
    Tracked,
}

impl Default for Config {
    fn default() -> Self {
        let step = ViewSettings::default();
        let track = TrackSettings::default();
        Self {
            evidence_window: match step.window {
                EvidenceWindow::All => Window::All(All::All),
                EvidenceWindow::Around(reach) => Window::Levels(reach),
            },
            candidates: step.n_candidates,
            min_separation: step.min_separation,
            threads: 1,
            precision: step.precision,
            search: Search::default(),
            tracked_levels: track.levels,
            tracked_margin: track.margin,
            tracked_full_every: track.full_every,
            tracked_max_gap: track.max_gap,
            tracked_max_drop: track.max_drop,
            tracked_speed: track.speed,
            tracked_max_gap_ms: 1000.0 * track.max_gap_s,
            tracked_full_every_ms: 1000.0 * track.full_every_s,
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
            precision: self.precision,
            track: (self.search == Search::Tracked).then_some(TrackSettings {
                levels: self.tracked_levels,
                margin: self.tracked_margin,
                full_every: self.tracked_full_every,
                max_gap: self.tracked_max_gap,
                max_drop: self.tracked_max_drop,
                speed: self.tracked_speed,
                max_gap_s: self.tracked_max_gap_ms / 1000.0,
                full_every_s: self.tracked_full_every_ms / 1000.0,
            }),
        }
    }
}

/// Levels of the pyramid around those of the candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number of levels, or \"all\"")]
pub enum Window {
    /// A number of levels on either side of every candidate's level.
    Levels(u16),
    /// All levels.
    All(All),
}

/// The value `all`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum All {
    /// All levels.
    All,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_step() {
        assert_eq!(Config::default().settings(), ViewSettings::default());
    }

    #[test]
    fn reduced_precision_must_be_requested_by_name() {
        let of =
            |text: &str| toml::from_str::<Config>(text).map(|config| config.settings().precision);
        assert_eq!(of("search = \"tracked\""), Ok(Precision::F32));
        assert_eq!(of("precision = \"bf16\""), Ok(Precision::Bf16));
        of("precision = \"f16\"").unwrap_err();
    }

    #[test]
    fn tracking_without_other_settings_has_its_defaults() {
        let config: Config = toml::from_str("search = \"tracked\"").unwrap();
        assert_eq!(config.settings().track, Some(TrackSettings::default()));
    }
}
