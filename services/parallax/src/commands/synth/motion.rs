//! Recorded motion in the place of an action.

use std::path::{Path, PathBuf};

use clap::Args;
use runtime::{ExitKind, Failure, OrFail as _};
use scene::{Posture, Recording};
use sequences::{MarkerTable, Motion, MotionError, MotionOptions, PRESETS, read_motion};

/// What was recorded; nothing if not given.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Recorded motion")]
pub(super) struct MotionArguments {
    /// The subjects do what a C3D or TRC file has, in the place of an action.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["actions", "live"])]
    motion: Option<PathBuf>,
    /// How its markers become joints: cmu, pose2sim, parallax, optitrack36, or a file like those of configs/markers;
    /// the first of these four whose markers are there if not given.
    #[arg(long, value_name = "TABLE", requires = "motion")]
    markers: Option<PathBuf>,
    /// First and last frame of the file, as it counts; all if not given.
    #[arg(long, value_name = "FIRST-LAST", requires = "motion", value_parser = frames)]
    motion_frames: Option<[u32; 2]>,
    /// Longest gap of a marker that is bridged by a straight line, seconds.
    #[arg(long, value_name = "S", default_value_t = MotionOptions::default().max_gap_s, requires = "motion")]
    motion_gap: f64,
}

impl MotionArguments {
    /// Reads what was recorded, if anything is to be performed.
    pub(super) fn recording(&self) -> Result<Option<Recording>, Failure> {
        let Some(file) = &self.motion else {
            return Ok(None);
        };
        let table = self.markers.as_deref().map(table).transpose()?;
        let options = MotionOptions {
            frames: self.motion_frames,
            max_gap_s: self.motion_gap,
        };
        let motion = read_motion(file, table.as_ref(), &options).map_err(failed)?;
        Ok(Some(recording(file, &motion)))
    }
}

/// `FIRST-LAST`.
fn frames(text: &str) -> Result<[u32; 2], String> {
    let range = text.split_once('-');
    let range = range.and_then(|(from, to)| Some([from.parse().ok()?, to.parse().ok()?]));
    range.ok_or_else(|| "expected the first and the last frame, for example 1-600".to_owned())
}

fn table(name: &Path) -> Result<MarkerTable, Failure> {
    let preset = name.to_str().filter(|it| PRESETS.contains(it));
    match preset.and_then(MarkerTable::preset) {
        Some(table) => Ok(table),
        None => MarkerTable::read(name).map_err(failed),
    }
}

fn failed(error: MotionError) -> Failure {
    let hint = match &error {
        MotionError::NoPreset { .. } | MotionError::NoMarker { .. } => {
            "configs/markers/cmu.toml shows what a marker table looks like: --markers my.toml"
        }
        MotionError::Gap { .. } => "choose other frames (--motion-frames 1-600), or --motion-gap S",
        MotionError::Frames { .. } => {
            return Failure::new(ExitKind::Usage, error);
        }
        _ => return Failure::new(ExitKind::Input, error),
    };
    Failure::new(ExitKind::Input, error).with_hint(hint)
}

fn recording(file: &Path, motion: &Motion) -> Recording {
    let toes = motion.toes.as_ref();
    let postures = motion.joints.iter().enumerate();
    let postures = postures.map(|(frame, joints)| Posture {
        joints: *joints,
        toes: toes.map(|it| it[frame]),
    });
    Recording {
        name: name(file),
        rate_hz: motion.rate_hz,
        postures: postures.collect(),
    }
}

/// A name for folders and deployments: lower case, digits and hyphens, not long.
fn name(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |it: char| if it.is_ascii_alphanumeric() { it } else { '-' };
    let name: String = stem
        .to_ascii_lowercase()
        .chars()
        .map(plain)
        .take(16)
        .collect();
    match name.trim_matches('-') {
        "" => "motion".to_owned(),
        name => name.to_owned(),
    }
}

/// Frames of every camera: as many as are asked for, or as there are.
///
/// * `none`: what is asked for where nothing is said and nothing was recorded.
pub(super) fn n_frames(
    asked: Option<u64>,
    rate_hz: f64,
    recording: Option<&Recording>,
    none: u64,
) -> Result<u64, Failure> {
    let Some(recording) = recording else {
        return Ok(asked.unwrap_or(none));
    };
    // The last frame may lie on the last posture.
    let most = (recording.seconds() * rate_hz + 1e-6).floor() as u64 + 1;
    match asked {
        Some(asked) if asked > most => Err(format!(
            "{asked} frames, but what was recorded ends after {most} at {rate_hz} frames a second"
        ))
        .or_fail(ExitKind::Usage),
        asked => Ok(asked.unwrap_or(most)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_into_those_of_deployments() {
        for (file, expected) in [
            ("a/CMU_02_05.c3d", "cmu-02-05"),
            ("Marché très longue course.trc", "march--tr-s-long"),
            ("__.trc", "motion"),
        ] {
            assert_eq!(name(Path::new(file)), expected);
        }
    }

    #[test]
    fn no_more_frames_than_were_recorded() {
        let posture = Posture {
            joints: [[0.0; 3]; 14],
            toes: None,
        };
        let recording = Recording {
            name: String::new(),
            rate_hz: 120.0,
            postures: vec![posture; 121],
        };
        let n = |asked| n_frames(asked, 30.0, Some(&recording), 60).ok();
        assert_eq!(n(None), Some(31));
        assert_eq!(n(Some(31)), Some(31));
        assert_eq!(n(Some(32)), None);
        assert_eq!(n_frames(None, 30.0, None, 60).ok(), Some(60));
    }

    #[test]
    fn frames_of_the_file_are_two_numbers() {
        assert_eq!(frames("1-600"), Ok([1, 600]));
        for text in ["", "5", "5-", "-5", "a-b"] {
            assert!(frames(text).is_err(), "{text}");
        }
    }
}
