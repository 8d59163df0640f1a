//! Options for recorded motion that replaces an action.

use std::path::PathBuf;

use clap::Args;
use failure::Failure;
use lab::synth;
use scene::Recording;
use training::datasets::sequences::MotionOptions;

/// Recorded motion; none by default.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Recorded motion")]
pub(super) struct MotionArguments {
    /// Animate the subjects with the motion recorded in a C3D or TRC file, instead of an action.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["actions", "live"])]
    motion: Option<PathBuf>,
    /// Table that maps the markers of the file to joints: cmu, pose2sim, parallax, optitrack36, or a file like those in configs/markers. If
    /// not given, the first of the four named tables whose markers are all in the file.
    #[arg(long, value_name = "TABLE", requires = "motion")]
    markers: Option<PathBuf>,
    /// First and last frame, as numbered in the file. If not given, all frames.
    #[arg(long, value_name = "FIRST-LAST", requires = "motion", value_parser = frames)]
    motion_frames: Option<[u32; 2]>,
    /// Longest gap in a marker's track that is interpolated linearly, in seconds.
    #[arg(long, value_name = "S", default_value_t = MotionOptions::default().max_gap_s, requires = "motion")]
    motion_gap: f64,
}

impl MotionArguments {
    /// Reads the recorded motion, if a file is given.
    pub(super) fn recording(&self) -> Result<Option<Recording>, Failure> {
        let Some(file) = &self.motion else {
            return Ok(None);
        };
        let table = self.markers.as_deref().map(synth::marker_table);
        let table = table.transpose()?;
        let options = MotionOptions {
            frames: self.motion_frames,
            max_gap_s: self.motion_gap,
        };
        synth::recording(file, table.as_ref(), &options).map(Some)
    }
}

/// Parses `FIRST-LAST`.
fn frames(text: &str) -> Result<[u32; 2], String> {
    let range = text.split_once('-');
    let range = range.and_then(|(from, to)| Some([from.parse().ok()?, to.parse().ok()?]));
    range.ok_or_else(|| "expected the first and the last frame, for example 1-600".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_frames_is_parsed_from_two_numbers() {
        assert_eq!(frames("1-600"), Ok([1, 600]));
        for text in ["", "5", "5-", "-5", "a-b"] {
            assert!(frames(text).is_err(), "{text}");
        }
    }
}
