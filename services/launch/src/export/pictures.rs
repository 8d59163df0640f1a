//! The pictures of a view, frame by frame, from its footage or from the recording.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

use capture::{Blank, Retimed};
use exports::ViewCamera;
use failure::{ExitKind, Failure, OrFail as _, in_file};
use footage::SourceSpec;
use messages::topic;
use recording::{Buffer, Entry, Kind, Recording};

use super::origin::camera as camera_of;
use super::{Origin, of_footage};
use crate::prepare;
use crate::resolved::Resolved;

/// The pictures of a view. Frames must be requested in order.
#[derive(Debug)]
pub(super) struct Pictures {
    /// The camera, with intrinsics for these pictures.
    pub(super) view: ViewCamera,
    from: From,
}

#[derive(Debug)]
enum From {
    Footage {
        feed: Box<Retimed>,
        /// Number of the last frame that the feed returned.
        at: Option<u64>,
        is_over: bool,
    },
    Recording {
        path: PathBuf,
        file: File,
        frames: BTreeMap<u64, Entry>,
        buffer: Buffer,
    },
}

impl Pictures {
    /// Opens the pictures of all views.
    ///
    /// # Errors
    ///
    /// Fails if a view has no pictures, because it was live and not recorded, or has only keypoints. Also fails if its footage cannot be
    /// read.
    pub(super) fn all(origin: &Origin) -> Result<Vec<Self>, Failure> {
        let (resolved, rig) = origin.setup()?;
        let cameras = resolved.deployment.cameras.iter().enumerate();
        let all = cameras.map(|(nth, camera)| {
            let found = footage(origin, resolved, nth);
            let from_recording = || {
                let recording = origin.recording.as_ref()?;
                recorded(origin, recording, nth)
            };
            let (from, view) = match (found, from_recording()) {
                (Ok(from), _) => (from, camera_of(resolved, rig, nth)?),
                (Err(_), Some(from)) => {
                    let framing = prepare::framing(resolved, rig, nth)?;
                    let size = framing.out_size();
                    let mut view = of_footage(&camera.name, &framing, size);
                    view.picture_from_camera = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
                    (from, view)
                }
                (Err(why), None) => return Err(none(&camera.name, &why)),
            };
            Ok(Self { view, from })
        });
        all.collect()
    }

    /// Returns the picture of a frame: RGB, row major, of the size of the view. Returns `None` if the frame has no picture.
    ///
    /// # Errors
    ///
    /// Fails if the footage or the recording cannot be read.
    pub(super) fn at(&mut self, frame: u64) -> Result<Option<&[u8]>, Failure> {
        let n_bytes = 3 * self.view.size.iter().map(|size| *size as usize).product::<usize>();
        match &mut self.from {
            From::Footage { feed, at, is_over } => {
                while !*is_over && at.is_none_or(|at| at < frame) {
                    let next = feed.next_frame().or_fail(ExitKind::Input)?;
                    *is_over = next.is_none();
                    *at = next.map(|frame| frame.index).or(*at);
                }
                let is_it = *at == Some(frame) && feed.pixels().len() == n_bytes;
                Ok(is_it.then(|| feed.pixels()))
            }
            From::Recording {
                path,
                file,
                frames,
                buffer,
            } => {
                let Some(entry) = frames.get(&frame) else {
                    return Ok(None);
                };
                match recording::read(file, Kind::Frame, entry, buffer) {
                    Ok(message) if message.elements.len() == n_bytes => Ok(Some(message.elements)),
                    Err(error @ recording::ReadError::Read(_)) => Err(in_file(path, &error)),
                    // A damaged picture counts as missing.
                    Ok(_) | Err(_) => Ok(None),
                }
            }
        }
    }
}

fn none(camera: &str, why: &str) -> Failure {
    let message = format!("camera {camera:?} has no pictures to draw on: {why}");
    Failure::new(ExitKind::Input, message).with_hint(
        "leave out mp4, or export a recording of `parallax record`, which contains pictures (except with `--without pixels`)",
    )
}

fn footage(origin: &Origin, resolved: &Resolved, nth: usize) -> Result<From, String> {
    let camera = &resolved.deployment.cameras[nth];
    if camera.source.is_empty() || Blank::is_blank(&camera.source) {
        return Err("it has only keypoints".to_owned());
    }
    if crate::cameras::is_live(&camera.source) {
        return Err("it was live".to_owned());
    }
    // All trials have the same frames and times.
    let trial = &origin.trials[0];
    let spec = SourceSpec {
        start: trial.first_frame,
        step: trial.frame_step,
        count: Some(trial.slots.len() as u64),
        ..crate::cameras::source(camera, &resolved.deployment.capture)
    };
    let footage = resolved.footage.get(nth);
    let feed = Retimed::open(&spec, footage.and_then(|footage| footage.timeline.as_ref()));
    let feed = feed.map_err(|error| failure::wording::in_one_line(&error))?;
    let size = feed.info().size;
    let due = footage.map_or([0; 2], |footage| footage.size.map(|size| size as usize));
    if [size.width, size.height] != due {
        return Err(format!(
            "{} is {size}, but was {}x{} in the run",
            camera.source, due[0], due[1]
        ));
    }
    Ok(From::Footage {
        feed: Box::new(feed),
        at: None,
        is_over: false,
    })
}

fn recorded(origin: &Origin, recording: &Recording, nth: usize) -> Option<From> {
    let track = recording.tracks.get(&topic::frame(nth))?;
    let has_pixels = !recording.about.as_ref().is_ok_and(|about| about.without.pixels);
    let frames = track.entries.iter().filter_map(|entry| Some((entry.frame?, *entry)));
    has_pixels.then_some(From::Recording {
        path: origin.source.clone(),
        file: files::open(&origin.source).ok()?,
        frames: frames.collect(),
        buffer: Buffer::default(),
    })
}
