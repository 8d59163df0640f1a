//! From the section `[quality]` of a deployment to the rows of its table.

use deployment::quality::Config;
use viewquality::Selection;

/// Which rows of the table are meant.
pub fn selection(config: &Config) -> Selection {
    Selection {
        subject: config.subject.clone().unwrap_or_default(),
        action: config.action.clone().unwrap_or_default(),
        frame_offset: config.frame_offset,
        frame_step: config.frame_step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_as_the_file_says() {
        let config = Config {
            frame_offset: 80,
            frame_step: 4,
            ..Config::default()
        };
        assert_eq!(selection(&config).table_frame(3), Some(92));
        assert_eq!(selection(&Config::default()), Selection::default());
    }
}
