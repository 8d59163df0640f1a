//! Sequences written by `parallax-lab synth`: `truth.jsonl`, `rig.toml`, and a folder for each camera.

use std::path::Path;

use geometry::files::ReadOptions;
use serde::Deserialize;
use skeleton::PARSE14;

use crate::datasets::sequences::error::{invalid, text};
use crate::datasets::sequences::{Frame, Options, Sequence, SequenceError, View};

/// Name of the file that identifies such a folder.
pub(crate) const TRUTH: &str = "truth.jsonl";

/// The part of the first line that is needed here. The crate `scene` documents the format.
#[derive(Debug, Deserialize)]
struct Header {
    format: String,
    version: u32,
    subject: u64,
    action: String,
    frame_rate_hz: f64,
    joints: Vec<String>,
    cameras: Vec<String>,
}

/// The part of the other lines that is needed here.
#[derive(Debug, Deserialize)]
struct Line {
    frame: u64,
    joints: Vec<[f64; 3]>,
}

/// Reads the folder of one sequence.
pub(crate) fn read(folder: &Path, options: &Options) -> Result<Sequence, SequenceError> {
    let path = folder.join(TRUTH);
    let text = text(&path)?;
    let mut lines = text.lines().enumerate();
    let (_, first) = lines.next().ok_or_else(|| invalid(&path, 1, "no header"))?;
    let header: Header =
        serde_json::from_str(first).map_err(|error| invalid(&path, 1, error.to_string()))?;
    if (header.format.as_str(), header.version) != ("parallax-truth", 2) {
        let (format, version) = (header.format, header.version);
        let what = format!("{format:?} {version}, expected \"parallax-truth\" 2");
        return Err(invalid(&path, 1, what));
    }
    if !header.joints.iter().eq(PARSE14.joints.iter().map(|joint| joint.name)) {
        return Err(invalid(&path, 1, "the joints are not the 14 of PARSE"));
    }
    let mut frames = Vec::new();
    for (index, line) in lines {
        let at = |what: String| invalid(&path, index + 1, what);
        let line: Line = serde_json::from_str(line).map_err(|error| at(error.to_string()))?;
        if line.joints.len() != PARSE14.joints.len() {
            return Err(at(format!("{} joints, expected 14", line.joints.len())));
        }
        frames.push(Frame {
            number: line.frame,
            index: line.frame,
            joints: line.joints.into_iter().map(Some).collect(),
        });
    }
    let range = options.range(frames.len());
    frames = frames.drain(range).collect();
    let rig = geometry::files::read(&folder.join("rig.toml"), &ReadOptions::default())?;
    let known = rig.cameras().iter().map(|camera| camera.name.as_str());
    if !header.cameras.iter().map(String::as_str).eq(known) {
        return Err(invalid(&path, 1, "the cameras are not those of `rig.toml`"));
    }
    let view = |camera: &String| View {
        camera: camera.clone(),
        source: folder.join("cameras").join(camera).to_string_lossy().into_owned(),
        first: 0,
        source_offset_px: None,
    };
    let subject = format!("s{}", header.subject);
    Ok(Sequence {
        name: format!("{subject} {}", header.action),
        dataset: "synthetic".to_owned(),
        subject,
        action: header.action,
        views: header.cameras.iter().map(view).collect(),
        rig,
        frame_rate_hz: Some(header.frame_rate_hz).filter(|rate| rate.is_finite() && *rate > 0.0),
        joints: &PARSE14,
        frames,
    })
}
