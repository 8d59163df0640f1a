//! Sequences described by a file: cameras, footage, and a TRC file with the joints.

use std::path::{Path, PathBuf};

use formats::trc::Trc;
use geometry::Rig;
use geometry::files::ReadOptions;
use serde::Deserialize;
use skeleton::JointSet;
use statistics::score::Point;

use crate::datasets::sequences::error::{invalid, text};
use crate::datasets::sequences::{Frame, Options, Sequence, SequenceError, View};

/// Content of the description file. Paths are relative to the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    /// Name of the sequence.
    name: String,
    /// Name of the data set.
    #[serde(default)]
    dataset: Option<String>,
    /// Name of the subject.
    #[serde(default)]
    subject: String,
    /// Name of the action; by default, the name of the sequence.
    #[serde(default)]
    action: Option<String>,
    /// Path of the calibration.
    rig: PathBuf,
    /// The views.
    camera: Vec<CameraEntry>,
    /// The true joints in space.
    truth: Truth,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraEntry {
    name: String,
    source: String,
    #[serde(default)]
    first_frame: u64,
    #[serde(default)]
    source_offset_px: Option<[u32; 2]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Truth {
    /// Path of a TRC file.
    trc: PathBuf,
    /// Frame of the sequence that corresponds to the first row of the file.
    #[serde(default)]
    first_frame: u64,
    /// Axes of the file that are the world's x, y and z; `["z", "x", "y"]` if y is up.
    world_from_file: [Axis; 3],
    /// Name of the joint set.
    joints: String,
    /// The marker of every joint, in the order of the set.
    markers: Vec<String>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Axis {
    X,
    Y,
    Z,
}

/// Reads a description and the files that it refers to.
pub(crate) fn read(file: &Path, options: &Options) -> Result<Sequence, SequenceError> {
    let description: Description =
        toml::from_str(&text(file)?).map_err(|error| invalid(file, 0, error.to_string()))?;
    let folder = file.parent().unwrap_or_else(|| Path::new("."));
    let rig_file = folder.join(&description.rig);
    let all = geometry::files::read(&rig_file, &ReadOptions::default())?;
    let mut cameras = Vec::new();
    let mut views = Vec::new();
    for entry in &description.camera {
        let camera = all.camera(&entry.name).ok_or_else(|| SequenceError::NoCamera {
            path: rig_file.clone(),
            name: entry.name.clone(),
        })?;
        cameras.push(camera.clone());
        views.push(View {
            camera: entry.name.clone(),
            source: folder.join(&entry.source).to_string_lossy().into_owned(),
            first: entry.first_frame,
            source_offset_px: entry.source_offset_px,
        });
    }
    let rig = Rig::new(cameras, all.up_in_world(), all.source()).map_err(|source| {
        let path = rig_file.clone();
        SequenceError::Cameras { path, source }
    })?;
    let (frame_rate_hz, joints, frames) = truth(file, folder, &description.truth, options)?;
    let action = description.action.unwrap_or_else(|| description.name.clone());
    Ok(Sequence {
        dataset: description.dataset.unwrap_or_else(|| description.name.clone()),
        name: description.name,
        subject: description.subject,
        action,
        rig,
        views,
        frame_rate_hz: Some(frame_rate_hz).filter(|rate| rate.is_finite() && *rate > 0.0),
        joints,
        frames,
    })
}

fn truth(
    file: &Path,
    folder: &Path,
    truth: &Truth,
    options: &Options,
) -> Result<(f64, &'static JointSet, Vec<Frame>), SequenceError> {
    let set = JointSet::by_name(&truth.joints)
        .ok_or_else(|| invalid(file, 0, format!("unknown joint set {:?}", truth.joints)))?;
    if truth.markers.len() != set.joints.len() {
        let (got, expected) = (truth.markers.len(), set.joints.len());
        let what = format!("{got} markers, but {} has {expected} joints", set.name);
        return Err(invalid(file, 0, what));
    }
    let path = folder.join(&truth.trc);
    let trc = Trc::parse(&text(&path)?).map_err(|source| {
        let path = path.clone();
        SequenceError::Trc { path, source }
    })?;
    let metres = match trc.units.as_str() {
        "m" => 1.0,
        "mm" => 0.001,
        units => {
            let units = units.to_owned();
            return Err(SequenceError::Units { path, units });
        }
    };
    let column = |name: &String| {
        trc.marker(name).ok_or_else(|| SequenceError::NoPoint {
            path: path.clone(),
            name: name.clone(),
        })
    };
    let columns = truth.markers.iter().map(column);
    let columns: Vec<usize> = columns.collect::<Result<_, _>>()?;
    let place = |point: Point| truth.world_from_file.map(|axis| metres * point[axis as usize]);
    let frame = |row: usize| {
        let index = truth.first_frame + row as u64;
        let joints = columns.iter().map(|&column| trc.frames[row][column].map(place));
        Frame {
            number: index,
            index,
            joints: joints.collect(),
        }
    };
    Ok((
        trc.rate_hz,
        set,
        options.range(trc.frames.len()).map(frame).collect(),
    ))
}
