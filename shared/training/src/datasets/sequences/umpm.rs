//! UMPM in its own layout: a folder for each sequence, with the calibrations beside the folders.
//!
//! `SEQ/SEQ.json` names the calibration. `SEQ/Video/SEQ_{f,l,r,s}.avi` have 50 frames per second of 644x486 pixels.
//! `SEQ/Groundtruth/SEQ_vm.c3d` has the 15 joints of the person at 100 Hz, so that every second pose corresponds to a frame.
//! If there are several people, the first is used. The videos are distributed packed
//! (`.avi.xz`).

use std::path::{Path, PathBuf};

use geometry::Rig;
use geometry::files::ReadOptions;
use nalgebra::Vector3;
use skeleton::UMPM15;

use crate::datasets::sequences::error::{invalid, motion, text};
use crate::datasets::sequences::{Alignment, Frame, Options, Sequence, SequenceError, View};

const CAMERAS: [&str; 4] = ["f", "l", "r", "s"];

/// Number of poses per camera frame.
const POSES_PER_FRAME: usize = 2;

/// Frames per second of the cameras.
const FRAME_RATE_HZ: f64 = 50.0;

/// Path of the description of the sequence in a folder, if it is a sequence of UMPM.
pub(crate) fn description(folder: &Path) -> Option<PathBuf> {
    let name = folder.file_name()?.to_str()?;
    let file = folder.join(format!("{name}.json"));
    (file.is_file() && folder.join("Groundtruth").is_dir()).then_some(file)
}

/// Reads the folder of one sequence.
pub(crate) fn read(folder: &Path, options: &Options) -> Result<Sequence, SequenceError> {
    let description = description(folder).ok_or_else(|| SequenceError::Unknown {
        path: folder.to_owned(),
    })?;
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let calibration = value(&text(&description)?, "calib")
        .ok_or_else(|| invalid(&description, 0, "no `calib`"))?;
    let (rig, views) = cameras(folder, &name, &calibration)?;
    let file = folder.join("Groundtruth").join(format!("{name}_vm.c3d"));
    let (trial, metres) = motion(&file)?;
    let n_joints = UMPM15.joints.len();
    if trial.n_points() < n_joints {
        let what = format!(
            "{} points, expected {n_joints} for a person",
            trial.n_points()
        );
        return Err(invalid(&file, 0, what));
    }
    let n = trial.n_frames().div_ceil(POSES_PER_FRAME);
    let frame = |index: usize| {
        let nth = match options.alignment {
            Alignment::Direct => index,
            Alignment::OneLate => index.checked_sub(1)?,
        };
        let points = &trial.frame(nth * POSES_PER_FRAME)[..n_joints];
        let joints =
            points.iter().map(|joint| joint.map(|point| point.map(|value| value * metres)));
        Some(Frame {
            number: index as u64 + 1,
            index: index as u64,
            joints: joints.collect(),
        })
    };
    // The parts of `p1_chair_2` are people, action and trial.
    let mut words = name.split('_');
    let subject = words.next().unwrap_or_default().to_owned();
    let action = words.next().map_or_else(|| name.to_string(), capital);
    Ok(Sequence {
        name: name.to_string(),
        dataset: "UMPM".to_owned(),
        subject,
        action,
        rig,
        views,
        frame_rate_hz: Some(FRAME_RATE_HZ),
        joints: &UMPM15,
        frames: options.range(n).filter_map(frame).collect(),
    })
}

fn cameras(
    folder: &Path,
    name: &str,
    calibration: &str,
) -> Result<(Rig, Vec<View>), SequenceError> {
    let beside = folder.parent().unwrap_or(folder);
    let places = [
        folder.join("Calib"),
        beside.join("Calib"),
        folder.to_owned(),
    ];
    let file = |camera: &str| format!("{calibration}_{camera}.ini");
    let place = places.iter().find(|place| place.join(file("f")).is_file());
    let place = place.unwrap_or(&places[1]);
    let files = CAMERAS.map(|camera| place.join(file(camera)));
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    let options = ReadOptions {
        up: Some(Vector3::z_axis()),
        ..ReadOptions::default()
    };
    let rig = geometry::files::read_many(&files, &options)?;
    let view = |(camera, of_rig): (&str, &geometry::Camera)| {
        let stem = folder.join("Video").join(format!("{name}_{camera}"));
        let [video, packed] = ["avi", "avi.xz"].map(|name| stem.with_extension(name));
        if packed.is_file() && !video.is_file() {
            let hint = "unpack it first (`xz -dk`)";
            return Err(SequenceError::NoFootage { path: packed, hint });
        }
        // A folder of pictures is accepted too.
        let source = if stem.is_dir() { stem } else { video };
        if !source.exists() {
            let hint = "expected this video, or a folder of its pictures with the same name but without .avi";
            return Err(SequenceError::NoFootage { path: source, hint });
        }
        Ok(View {
            camera: of_rig.name.clone(),
            source: source.to_string_lossy().into_owned(),
            first: 0,
            source_offset_px: None,
        })
    };
    let views = CAMERAS.into_iter().zip(rig.cameras()).map(view);
    let views = views.collect::<Result<_, _>>()?;
    Ok((rig, views))
}

/// Finds a string in a JSON object. Some files of the data set have a trailing comma, so they cannot be parsed as JSON.
fn value(text: &str, key: &str) -> Option<String> {
    let (_, rest) = text.split_once(&format!("\"{key}\""))?;
    let rest = rest.trim_start().strip_prefix(':')?.trim_start();
    let (value, _) = rest.strip_prefix('"')?.split_once('"')?;
    Some(value.to_owned())
}

/// Capitalises a word as in the paper's tables: `chair` becomes `Chair`.
fn capital(word: &str) -> String {
    let mut letters = word.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trailing_comma_is_accepted() {
        let text = "{ \"id\": 7, \"calib\" : \"calib_l06\", }";
        assert_eq!(value(text, "calib").as_deref(), Some("calib_l06"));
        assert_eq!(value(text, "video"), None);
    }
}
