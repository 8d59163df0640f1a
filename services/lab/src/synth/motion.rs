//! Recorded motion in the place of an action.

use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _};
use scene::{Posture, Recording};
use training::datasets::sequences::{
    MarkerTable, Motion, MotionError, MotionOptions, PRESETS, read_motion,
};

/// A table of how markers become joints: one that ships, by its name, or a file.
///
/// # Errors
///
/// The file cannot be read, or is not such a table.
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

/// Reads what was recorded, to be performed.
///
/// * `file`: C3D or TRC.
/// * `table`: how its markers become joints; the first one that ships whose markers are there if not given.
///
/// # Errors
///
/// The file cannot be read; markers or frames are not there; nobody moves so.
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

/// A name for folders and deployments: lower case, digits and hyphens, not long.
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

/// Frames of every camera: as many as are asked for, or as there are.
///
/// * `none`: what is asked for where nothing is said and nothing was recorded.
///
/// # Errors
///
/// Fewer were recorded.
pub fn n_frames(
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
}
