//! Converts the section `[paper]` of a deployment to the settings of the single-view step.

use deployment::paper::{Config, Search};
use fmp::TrackSettings;
use pipeline::ViewSettings;

/// Returns the settings of the single-view step, without the settings that are read from files.
pub fn settings(config: &Config) -> ViewSettings {
    ViewSettings {
        n_candidates: config.candidates,
        track: (config.search == Search::Tracked).then(TrackSettings::default),
        ..ViewSettings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_equal_those_of_the_step() {
        assert_eq!(settings(&Config::default()), ViewSettings::default());
    }

    #[test]
    fn the_tracked_search_has_the_default_settings_of_the_filters() {
        let config: Config = toml::from_str("search = \"tracked\"").unwrap();
        assert_eq!(settings(&config).track, Some(TrackSettings::default()));
    }
}
