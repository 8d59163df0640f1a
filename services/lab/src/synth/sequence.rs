//! One sequence: renders its pictures on all threads, and writes its truth and its deployment.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use failure::{Console, ExitKind, Failure, Stop};
use rayon::prelude::*;
use scene::truth::{Frame, View as Seen};
use scene::{Scene, SceneError, Settings, View};
use training::datasets::Person;

use super::people::People;
use super::{Job, files, rig_failure};
use inputs::make_folder;

/// Number of consecutive frames of one camera that one thread renders.
const CHUNK: u64 = 8;

/// A sequence to write.
#[derive(Debug)]
pub(super) struct Sequence<'a> {
    job: &'a Job,
    /// The scene, shared by all threads.
    scene: Arc<Scene>,
    folder: PathBuf,
    name: String,
}

impl<'a> Sequence<'a> {
    /// Prepares the scene and creates the folders.
    pub(super) fn new(
        job: &'a Job,
        settings: &Settings,
        folder: &Path,
        name: &str,
    ) -> Result<Self, Failure> {
        let scene = match &job.recording {
            Some(recording) => Scene::of_recording(settings, recording),
            None => Scene::new(settings),
        };
        let it = Self {
            job,
            scene: Arc::new(scene.map_err(failed)?),
            folder: folder.to_owned(),
            name: name.to_owned(),
        };
        let mut folders = vec![folder.to_owned()];
        for camera in it.scene.rig().cameras() {
            if !job.live {
                folders.push(folder.join("cameras").join(&camera.name));
                if job.with_masks {
                    folders.push(folder.join("masks").join(&camera.name));
                }
            }
        }
        for folder in folders {
            make_folder(&folder)?;
        }
        Ok(it)
    }

    pub(super) fn action(&self) -> &str {
        self.scene.action()
    }

    fn n_cameras(&self) -> usize {
        self.scene.rig().cameras().len()
    }

    pub(super) fn n_pictures(&self) -> u64 {
        self.job.n_frames * self.n_cameras() as u64
    }

    /// Writes all files except the annotated people, which are returned.
    pub(super) fn write(&self, stop: &Stop, console: &dyn Console) -> Result<People, Failure> {
        let views: Result<Vec<View>, SceneError> = (0..self.n_cameras())
            .into_par_iter()
            .map(|i| View::new(&self.scene, i))
            .collect();
        let views = views.map_err(failed)?;
        let n_chunks = self.job.n_frames.div_ceil(CHUNK);
        let tasks: Vec<(usize, u64)> = (0..n_chunks)
            .flat_map(|chunk| (0..views.len()).map(move |camera| (camera, chunk)))
            .collect();
        let seen: Result<Vec<Vec<Seen>>, Failure> = tasks
            .par_iter()
            .map(|&(camera, chunk)| {
                let mut view = views[camera].clone();
                let last = (CHUNK * (chunk + 1)).min(self.job.n_frames);
                (CHUNK * chunk..last)
                    .map(|frame| {
                        stop.check("stopped")?;
                        let seen = self.picture(&mut view, frame)?;
                        console.advance(1);
                        Ok(seen)
                    })
                    .collect()
            })
            .collect();
        let frames = self.frames(&seen?, views.len());
        files::truth(
            &self.folder.join("truth.jsonl"),
            &self.scene.header(),
            &frames,
        )?;
        files::rigs(&self.folder, &self.scene)?;
        files::deployment(&self.folder, &self.name, self.job, &self.scene)?;
        Ok(self.people(&frames))
    }

    /// Renders and writes one picture.
    fn picture(&self, view: &mut View, frame: u64) -> Result<Seen, Failure> {
        if self.job.live {
            return Ok(view.truth(frame));
        }
        let size = view.size();
        let mut rgb = vec![0; size.rgb_bytes()];
        let seen = view.picture(frame, &mut rgb);
        let name = format!("{frame:06}");
        let folder = self.folder.join("cameras").join(&seen.camera);
        files::picture(&folder, &name, self.job.format, size, &rgb)?;
        if self.job.with_masks {
            let folder = self.folder.join("masks").join(&seen.camera);
            files::mask(&folder.join(format!("{name}.png")), size, &view.mask())?;
        }
        Ok(seen)
    }

    /// Converts chunks of one camera to frames of all cameras.
    fn frames(&self, seen: &[Vec<Seen>], n_cameras: usize) -> Vec<Frame> {
        let frame = |frame: u64| {
            let (chunk, within) = ((frame / CHUNK) as usize, (frame % CHUNK) as usize);
            let of_camera = |camera: usize| seen[chunk * n_cameras + camera][within].clone();
            let seconds = self.scene.seconds(frame);
            Frame {
                frame,
                seconds,
                joints: self.scene.joints(seconds),
                others: self.scene.other_joints(seconds),
                views: (0..n_cameras).map(of_camera).collect(),
            }
        };
        (0..self.job.n_frames).map(frame).collect()
    }

    /// Returns all people in the pictures. Pictures that repeat the previous picture are not used.
    fn people(&self, frames: &[Frame]) -> People {
        let mut people = People::default();
        if self.job.live {
            return people;
        }
        for frame in frames {
            for seen in frame.views.iter().filter(|view| !view.repeated && view.outline.is_some()) {
                let file = files::name(&format!("{:06}", frame.frame), self.job.format);
                let image = Path::new("cameras").join(&seen.camera).join(file);
                let unknown = [f64::NAN; 2];
                let person = Person {
                    image,
                    row: String::new(),
                    joints: seen.pixels.iter().map(|pixel| pixel.unwrap_or(unknown)).collect(),
                    visible: seen.visible.to_vec(),
                };
                let name = format!("{}-{}-{:06}", self.name, seen.camera, frame.frame);
                people.add(person, name, seen.from_behind);
            }
        }
        people
    }
}

fn failed(error: SceneError) -> Failure {
    match error {
        SceneError::Rig(error) => rig_failure(error),
        SceneError::Calibration(_) => Failure::new(ExitKind::Usage, error),
        SceneError::Backdrop(_) | SceneError::NoCamera { .. } => {
            Failure::new(ExitKind::Input, error)
        }
    }
}
