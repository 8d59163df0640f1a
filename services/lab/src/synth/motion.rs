//! Recorded motion that replaces an action.

use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _};
use scene::{Posture, Recording};
use training::datasets::sequences::{
    MarkerTable, Motion, MotionError, MotionOptions, PRESETS, read_motion,
};

/// Reads a table that maps markers to joints: a shipped table by its name, or a file.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a table of markers.
pub fn marker_table(name: &Path) -> Result<MarkerTable, Failure> {
    let preset = name.to_str().filter(|text| PRESETS.contains(text));
    match preset.and_then(MarkerTable::preset) {
        Some(table) => Ok(table),
        None => MarkerTable::read(name).map_err(failed),
    }
}

fn failed(error: MotionError) -> Failure {
    let hint = match &error {
        MotionError::NoPreset { .. } | MotionError::NoMarker { .. } => {
            "write a marker table like configs/markers/cmu.toml, and pass it as --markers my.toml"
        }
        MotionError::Gap { .. } => {
            "choose other frames (--motion-frames 1-600), or allow longer gaps (--motion-gap S)"
        }
        MotionError::Frames { .. } => {
            return Failure::new(ExitKind::Usage, error);
        }
        _ => return Failure::new(ExitKind::Input, error),
    };
    Failure::new(ExitKind::Input, error).with_hint(hint)
}

/// Reads a recorded motion.
///
/// * `file`: C3D or TRC file.
/// * `table`: map from markers to joints; if `None`, the first shipped table whose markers are all in the file.
///
/// # Errors
///
/// Fails if the file cannot be read, if markers or frames are missing, or if the motion is impossible for a person.
pub fn recording(
    file: &Path,
    table: Option<&MarkerTable>,
    options: &MotionOptions,
) -> Result<Recording, Failure> {
    let motion = read_motion(file, table, options).map_err(failed)?;
    Ok(performed(file, &motion))
}

fn performed(file: &Path, motion: &Motion) -> Recording {
    let toes = motion.toes.as_ref();
    let postures = motion.joints.iter().enumerate();
    let postures = postures.map(|(frame, joints)| Posture {
        joints: *joints,
        toes: toes.map(|toe| toe[frame]),
    });
    Recording {
        name: name(file),
        rate_hz: motion.rate_hz,
        postures: postures.collect(),
    }
}

/// Returns a short name for folders and deployments: lower case letters, digits and hyphens.
fn name(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |letter: char| {
        if letter.is_ascii_alphanumeric() {
            letter
        } else {
            '-'
        }
    };
    let name: String = stem.to_ascii_lowercase().chars().map(plain).take(16).collect();
    match name.trim_matches('-') {
        "" => "motion".to_owned(),
        name => name.to_owned(),
    }
}

/// Returns the number of frames per camera: the requested number, or the length of the recording.
///
/// * `none`: the default if no number is requested and there is no recording.
///
/// # Errors
///
/// Fails if the recording is shorter than requested.
pub fn n_frames(
    asked: Option<u64>,
    rate_hz: f64,
    recording: Option<&Recording>,
    none: u64,
) -> Result<u64, Failure> {
    let Some(recording) = recording else {
        return Ok(asked.unwrap_or(none));
    };
    // The last frame may be exactly at the last posture.
    let most = (recording.seconds() * rate_hz + 1e-6).floor() as u64 + 1;
    match asked {
        Some(asked) if asked > most => Err(format!(
            "{asked} frames were requested, but at {rate_hz} frames per second the recording ends after {most} frames"
        ))
        .or_fail(ExitKind::Usage),
        asked => Ok(asked.unwrap_or(most)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_names_are_valid_in_deployment_names() {
        for (file, expected) in [
            ("a/CMU_02_05.c3d", "cmu-02-05"),
            ("Marché très longue course.trc", "march--tr-s-long"),
            ("__.trc", "motion"),
        ] {
            assert_eq!(name(Path::new(file)), expected);
        }
    }

    #[test]
    fn no_more_frames_are_made_than_were_recorded() {
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
}
