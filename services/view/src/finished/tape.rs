//! A recording, with the positions of its results and pictures in the file.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::pod_read_unaligned;
use failure::{ExitKind, Failure};
use launch::recorded::{self, Settings};
use messages::{FrameHeader, Skeletons, Status, topic};
use recording::{Buffer, Entry, Kind, Recording};

use super::{Finished, Frame, Kept};
use crate::moment::Moment;
use crate::picture;
use crate::scene::Scene;

/// A recording.
#[derive(Debug)]
pub(crate) struct Tape {
    file: Mutex<File>,
    poses: Vec<Entry>,
    /// Pictures of every view by frame number.
    pictures: Vec<BTreeMap<u64, Entry>>,
}

impl Tape {
    /// Opens a recording.
    pub(crate) fn open(path: &Path) -> Result<Finished, Failure> {
        let recording = recorded::open(path)?;
        let refused = |why: String| {
            let text = format!("{}: {why}", path.display());
            Failure::new(ExitKind::Input, text)
        };
        let about = recording.about.as_ref();
        let about = about.map_err(|why| refused(why.to_string()))?;
        let settings = serde_json::from_str::<Settings>(&about.settings);
        let settings =
            settings.map_err(|why| refused(format!("the settings cannot be read: {why}")))?;
        let scene = Scene::of_finished(&settings.resolved);
        let mut notes: Vec<String> = scene.problem.clone().into_iter().collect();
        note(&recording, &mut notes);
        let track = recording.tracks.get(&topic::skeletons());
        let mut poses = track.map_or_else(Vec::new, |track| track.entries.clone());
        let mut input = files::open(path).map_err(|why| failure::in_file(path, &why))?;
        poses.retain(|pose| {
            read_pose(&mut input, pose).is_ok_and(|message| message.status != Status::END)
        });
        if poses.is_empty() {
            return Err(refused("the recording has no results".to_owned()));
        }
        poses.sort_by_key(|pose| pose.frame);
        let frame = |(place, entry): (usize, &Entry)| Frame {
            number: entry.frame.unwrap_or(place as u64),
            has_pose: read_pose(&mut input, entry).ok().map(|message| message.status == Status::OK),
            place: place as u64,
        };
        let frames = poses.iter().enumerate().map(frame).collect();
        let of_view = |view: usize| {
            let track = recording.tracks.get(&topic::frame(view));
            let entries = track.into_iter().flat_map(|track| &track.entries);
            let with_pixels =
                entries.filter(|entry| entry.len as usize > size_of::<FrameHeader>() + 64);
            with_pixels.filter_map(|entry| Some((entry.frame?, *entry))).collect()
        };
        let tape = Self {
            pictures: (0..scene.views.len()).map(of_view).collect(),
            file: Mutex::new(input),
            poses,
        };
        Ok(Finished {
            name: path.display().to_string(),
            scene: Arc::new(scene),
            frames,
            notes,
            kept: Kept::Tape(tape),
        })
    }

    /// Returns a frame.
    pub(crate) fn moment(&self, scene: &Scene, place: u64) -> Result<Moment, Failure> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let message = read_pose(&mut file, &self.poses[place as usize])?;
        let n_joints = scene.joints.joints.len();
        let checked = wire::check_skeletons(&message, scene.views.len(), n_joints);
        checked.map_err(|why| Failure::new(ExitKind::Input, why))?;
        Ok(Moment::of_message(scene, &message))
    }

    /// Returns the picture of the frame, or the last picture before it.
    pub(crate) fn picture(&self, frame: u64, view: usize) -> Option<Vec<u8>> {
        let (frame, entry) = self.pictures.get(view)?.range(..=frame).next_back()?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let mut buffer = Buffer::default();
        let message = recording::read(&mut *file, Kind::Frame, entry, &mut buffer).ok()?;
        let head: FrameHeader = pod_read_unaligned(message.head);
        let size = [head.width as usize, head.height as usize];
        picture::message(view, *frame, size, message.elements, false)
    }
}

fn read_pose(file: &mut File, entry: &Entry) -> Result<Box<Skeletons>, Failure> {
    let mut buffer = Buffer::default();
    let message = recording::read(file, Kind::Skeletons, entry, &mut buffer);
    let message = message.map_err(|why| Failure::new(ExitKind::Input, why))?;
    let refused = || {
        Failure::new(
            ExitKind::Input,
            "a message of the results topic has the wrong kind",
        )
    };
    message.skeletons().ok_or_else(refused)
}

/// Adds the faults of a recording to the notes.
fn note(recording: &Recording, notes: &mut Vec<String>) {
    if !recording.extent.is_complete {
        notes.push("the recording was cut off, or is still being written".to_owned());
    }
    if !recording.extent.damage.is_empty() || recording.extent.n_malformed > 0 {
        notes.push("the recording is damaged; unreadable messages are left out".to_owned());
    }
    if recording.n_lost() > 0 {
        notes.push(format!(
            "{} messages are missing from the recording",
            recording.n_lost()
        ));
    }
}
