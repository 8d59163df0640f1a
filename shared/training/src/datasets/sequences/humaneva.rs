//! `HumanEva-I` in its own layout: a folder for each subject.
//!
//! A folder contains `Image_Data/Walking_1_(C1).avi` (or a folder of pictures, without the extension),
//! `Calibration_Data/C1.cal`, `Sync_Data/Walking_1_(C1).ofs`, `Mocap_Data/Walking_1.c3d`, `Static.c3d` and
//! `S1.mp`. The first five frames of every video repeat one frame, so trials begin at frame 6.

mod body;
mod sync;

use std::path::{Path, PathBuf};

use geometry::Rig;
use geometry::files::ReadOptions;
use nalgebra::Vector3;
use skeleton::HUMANEVA20;

use crate::datasets::sequences::error::{invalid, motion, text};
use crate::datasets::sequences::{Frame, Options, Sequence, SequenceError, SyncError, View};
use body::{Body, Measures};
use sync::Offset;
pub use sync::Sync;

/// The colour cameras, which the paper uses.
const CAMERAS: [&str; 3] = ["C1", "C2", "C3"];
/// All cameras, in the order in which the toolbox uses their offsets.
const ALL_CAMERAS: [&str; 7] = ["C1", "C2", "C3", "BW1", "BW2", "BW3", "BW4"];

/// Frames per second of the colour cameras.
const FRAME_RATE_HZ: f64 = 60.0;

/// The trial whose first half is the paper's test set. The authors of the data set intended this half for validation.
pub const TRIAL: u32 = 1;

/// The test frames of the paper for one subject and action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PaperTest {
    /// The subject.
    pub subject: &'static str,
    /// The action.
    pub action: &'static str,
    /// The first frame, from 1.
    pub first: u64,
    /// The last frame.
    pub last: u64,
    /// Number of frames, for each camera, in which all markers were captured.
    pub n_frames: usize,
}

const fn test(
    subject: &'static str,
    action: &'static str,
    frames: [u64; 2],
    n: usize,
) -> PaperTest {
    PaperTest {
        subject,
        action,
        first: frames[0],
        last: frames[1],
        n_frames: n,
    }
}

/// The 4493 test frames of each camera. They are the frames for which the authors of the paper released predicted errors.
pub const PAPER_TEST: [PaperTest; 12] = [
    test("S1", "Box", [6, 358], 249),
    test("S1", "Gestures", [6, 395], 390),
    test("S1", "Jog", [6, 364], 317),
    test("S1", "Walking", [6, 590], 558),
    test("S2", "Box", [6, 382], 258),
    test("S2", "Gestures", [8, 498], 416),
    test("S2", "Jog", [6, 398], 393),
    test("S2", "Walking", [6, 438], 433),
    test("S3", "Box", [6, 512], 507),
    test("S3", "Gestures", [6, 346], 164),
    test("S3", "Jog", [6, 401], 396),
    test("S3", "Walking", [6, 448], 412),
];

/// Reads the paper's test sequences of one subject. Sequences that do not exist are left out.
pub(crate) fn read_subject(
    folder: &Path,
    options: &Options,
) -> Result<Vec<Sequence>, SequenceError> {
    let subject = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut sequences = Vec::new();
    for test in PAPER_TEST.iter().filter(|test| test.subject == subject) {
        if trial(folder, test.action).is_file() {
            sequences.push(read(folder, test, options)?);
        }
    }
    if sequences.is_empty() {
        return Err(SequenceError::Unknown {
            path: folder.to_owned(),
        });
    }
    Ok(sequences)
}

fn trial(folder: &Path, action: &str) -> PathBuf {
    folder.join("Mocap_Data").join(format!("{action}_{TRIAL}.c3d"))
}

fn read(folder: &Path, test: &PaperTest, options: &Options) -> Result<Sequence, SequenceError> {
    let sync = sync(folder, test.action)?;
    let (rig, views) = cameras(folder, test.action, &sync)?;
    let file = trial(folder, test.action);
    let (motion, metres) = motion(&file)?;
    let measures = measures(folder, test.subject)?;
    let body = Body::new(&motion, measures).map_err(|name| SequenceError::NoPoint {
        path: file.clone(),
        name,
    })?;
    let frame = |number: u64| {
        let joints = body.joints(sync.motion_at(number))?;
        let joints = joints.iter().map(|joint| Some(joint.map(|value| value * metres)));
        Some(Frame {
            number,
            index: number - 1,
            joints: joints.collect(),
        })
    };
    let mut frames: Vec<Frame> = (test.first..=test.last).filter_map(frame).collect();
    let range = options.range(frames.len());
    frames = frames.drain(range).collect();
    Ok(Sequence {
        name: format!("{} {}", test.subject, test.action),
        dataset: "HumanEva".to_owned(),
        subject: test.subject.to_owned(),
        action: test.action.to_owned(),
        rig,
        views,
        frame_rate_hz: Some(FRAME_RATE_HZ),
        joints: &HUMANEVA20,
        frames,
    })
}

fn sync(folder: &Path, action: &str) -> Result<Sync, SequenceError> {
    let folder = folder.join("Sync_Data");
    let offset = |camera: &&str| {
        let path = folder.join(format!("{action}_{TRIAL}_({camera}).ofs"));
        if !path.is_file() {
            return Ok(None);
        }
        match Offset::parse(&text(&path)?) {
            Some(offset) => Ok(Some(offset)),
            None => Err(invalid(&path, 0, "expected three numbers")),
        }
    };
    let offsets = ALL_CAMERAS.iter().map(offset);
    let offsets: Vec<Option<Offset>> = offsets.collect::<Result<_, _>>()?;
    let failed = |source: SyncError| SequenceError::Sync {
        path: folder.clone(),
        source,
    };
    Sync::new(&offsets).map_err(failed)
}

fn cameras(folder: &Path, action: &str, sync: &Sync) -> Result<(Rig, Vec<View>), SequenceError> {
    let calibrations =
        CAMERAS.map(|camera| folder.join("Calibration_Data").join(format!("{camera}.cal")));
    let files: Vec<&Path> = calibrations.iter().map(PathBuf::as_path).collect();
    let options = ReadOptions {
        up: Some(Vector3::z_axis()),
        ..ReadOptions::default()
    };
    let rig = geometry::files::read_many(&files, &options)?;
    let view = |(nth, camera): (usize, &str)| {
        let stem = format!("{action}_{TRIAL}_({camera})");
        let pictures = folder.join("Image_Data").join(&stem);
        let video = folder.join("Image_Data").join(format!("{stem}.avi"));
        let source = if pictures.is_dir() { pictures } else { video };
        if !source.exists() {
            let hint = "expected this video, or a folder of its pictures with the same name but without .avi";
            return Err(SequenceError::NoFootage { path: source, hint });
        }
        let name = camera.to_owned();
        let path = folder.join("Sync_Data");
        let first = sync.image_first[nth].ok_or(SequenceError::NoCamera { path, name })?;
        Ok(View {
            camera: camera.to_owned(),
            source: source.to_string_lossy().into_owned(),
            first: first - 1,
            source_offset_px: None,
        })
    };
    let views = CAMERAS.into_iter().enumerate().map(view);
    let views = views.collect::<Result<_, _>>()?;
    Ok((rig, views))
}

fn measures(folder: &Path, subject: &str) -> Result<Measures, SequenceError> {
    let folder = folder.join("Mocap_Data");
    let (still, _) = motion(&folder.join("Static.c3d"))?;
    let file = folder.join(format!("{subject}.mp"));
    let parameters = text(&file)?;
    let what = "no LShoulderOffset and RShoulderOffset, or no shoulders in Static.c3d";
    Measures::new(&still, &parameters).ok_or_else(|| invalid(&file, 0, what))
}

#[cfg(test)]
mod tests;
