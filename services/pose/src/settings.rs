//! From the section `[pose]` of a deployment to the settings of the single-view step.

use deployment::pose::{All, Config, Search, Window};
use fmp::TrackSettings;
use pipeline::{EvidenceWindow, ViewSettings};

/// The settings of the single-view step, without what is read of files.
pub fn settings(config: &Config) -> ViewSettings {
    ViewSettings {
        window: match config.evidence_window {
            Window::All(All::All) => EvidenceWindow::All,
            Window::Levels(reach) => EvidenceWindow::Around(reach),
        },
        n_candidates: config.candidates,
        min_separation: config.min_separation,
        track: (config.search == Search::Tracked).then_some(TrackSettings {
            levels: config.tracked_levels,
            margin: config.tracked_margin,
            full_every: config.tracked_full_every,
            max_gap: config.tracked_max_gap,
            max_drop: config.tracked_max_drop,
            speed: config.tracked_speed,
            max_gap_s: config.tracked_max_gap_ms / 1000.0,
            full_every_s: config.tracked_full_every_ms / 1000.0,
        }),
        orientation: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_step() {
        assert_eq!(settings(&Config::default()), ViewSettings::default());
    }

    #[test]
    fn who_asks_for_tracking_by_name_gets_its_defaults() {
        let config: Config = toml::from_str("search = \"tracked\"").unwrap();
        assert_eq!(settings(&config).track, Some(TrackSettings::default()));
    }
}
