//! Sequences of synthetic people with ground truth: pictures, masks, rigs, annotations, deployments.

mod files;
mod motion;
mod people;
mod sequence;

use std::path::{Path, PathBuf};
use std::time::Instant;

use failure::{Console, ExitKind, Failure, Stop};
use scene::{Action, Flaws, Recording, RigChoice, RigChoiceError, Settings};
use serde_json::{Value, json};

pub use files::Format;
pub use motion::{marker_table, n_frames, recording};
use people::People;
use sequence::Sequence;

/// Description of the sequences to make: people, actions, cameras, and files.
#[derive(Debug)]
pub struct Job {
    /// Output folder, which must exist and be empty.
    pub out: PathBuf,
    /// The cameras.
    pub rig: RigChoice,
    /// Numbers of the subjects.
    pub subjects: Vec<u64>,
    /// Number of other people who stand around the subject.
    pub others: u64,
    /// Number of people who walk past the subject.
    pub passers: u64,
    /// Actions, with one sequence for each. They are not used if there is a `recording`.
    pub actions: Vec<Action>,
    /// Recorded motion that replaces an action.
    pub recording: Option<Recording>,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// Number of frames per camera.
    pub n_frames: u64,
    /// Frames per second.
    pub rate_hz: f64,
    /// File format of pictures.
    pub format: Format,
    /// True if masks are written.
    pub with_masks: bool,
    /// Folder of photographs that replace the room as the background.
    pub backdrop: Option<PathBuf>,
    /// Model that the deployment names; `None` to name no model.
    pub model: Option<PathBuf>,
    /// True to write no pictures: the cameras of the deployment render them during the run.
    pub live: bool,
    /// Simulated flaws of the cameras.
    pub flaws: Flaws,
    /// Delay of each camera's pictures after the nominal times of the frames, in milliseconds. There is at most one value for each camera
    /// of the rig.
    pub skews_ms: Vec<f64>,
}

/// All written sequences.
#[derive(Debug)]
pub struct Done {
    /// The sequences, subject by subject.
    pub sequences: Vec<Written>,
    /// Total time, in seconds.
    pub seconds: f64,
}

/// A written sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Folder of the sequence.
    pub folder: PathBuf,
    /// Number of the subject.
    pub subject: u64,
    /// Action of the subject.
    pub action: String,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// Number of pictures from all cameras, including pictures that the cameras render later.
    pub n_pictures: u64,
    /// Number of annotated people.
    pub n_people: usize,
}

impl Written {
    /// Returns the summary as JSON.
    pub fn json(&self) -> Value {
        json!({
            "folder": self.folder,
            "subject": self.subject,
            "action": self.action,
            "seed": self.seed,
            "pictures": self.n_pictures,
            "people": self.n_people,
        })
    }
}

/// Writes all sequences, on rayon's current pool; the files do not depend on the number of threads.
///
/// A single sequence is written to the folder itself. If there are several sequences, each has its own folder, and the annotated people of
/// all sequences are beside these folders.
///
/// # Errors
///
/// Fails if a rig, a backdrop or a flaw cannot be used, if a file cannot be written, or on a stop request ([`ExitKind::Interrupted`]).
pub fn write(job: &Job, stop: &Stop, console: &dyn Console) -> Result<Done, Failure> {
    let begin = Instant::now();
    let n_cameras = job.rig.rig().map_err(rig_failure)?.cameras().len();
    let is_one = job.n_sequences() == 1;
    console.set(0, job.n_sequences() * n_cameras * job.n_frames as usize);
    let mut all = People::default();
    let mut sequences = Vec::new();
    for &subject in &job.subjects {
        for &action in job.actions() {
            let name = job.name(subject, action);
            let folder = if is_one {
                job.out.clone()
            } else {
                job.out.join(&name)
            };
            let settings = job.settings(subject, action);
            let sequence = Sequence::new(job, &settings, &folder, &name)?;
            console.details(&name);
            let people = sequence.write(stop, console)?;
            sequences.push(Written {
                folder: folder.clone(),
                subject,
                action: sequence.action().to_owned(),
                seed: settings.seed,
                n_pictures: sequence.n_pictures(),
                n_people: people.len(),
            });
            people.write(&folder)?;
            all.append(&name, people);
        }
    }
    console.finish();
    if !is_one {
        all.write(&job.out)?;
    }
    let seconds = begin.elapsed().as_secs_f64();
    Ok(Done { sequences, seconds })
}

impl Job {
    /// Returns the actions; with recorded motion, a single action represents it.
    fn actions(&self) -> &[Action] {
        match self.recording {
            Some(_) => &[Action::Walking],
            None => &self.actions,
        }
    }

    fn n_sequences(&self) -> usize {
        self.subjects.len() * self.actions().len()
    }

    /// Returns the name of a sequence.
    fn name(&self, subject: u64, action: Action) -> String {
        let recorded = self.recording.as_ref().map(|recording| recording.name.as_str());
        format!("s{subject}-{}", recorded.unwrap_or(action.name()))
    }

    fn settings(&self, subject: u64, action: Action) -> Settings {
        Settings {
            rig: absolute(&self.rig),
            subject,
            others: self.others,
            passers: self.passers,
            action,
            seed: self.seed,
            rate_hz: self.rate_hz,
            backdrop: self.backdrop.as_deref().map(absolute_path),
            flaws: self.flaws,
            skews_ms: self.skews_ms.clone(),
        }
    }
}

/// Makes the path of a rig file absolute, so that it is valid in any working folder.
fn absolute(rig: &RigChoice) -> RigChoice {
    match rig {
        RigChoice::File(path) => RigChoice::File(absolute_path(path)),
        other => other.clone(),
    }
}

fn absolute_path(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Converts the error of a rig. A missing rig is an input error. A rig without an upward direction cannot be used either.
pub fn rig_failure(error: RigChoiceError) -> Failure {
    let kind = match error {
        RigChoiceError::NoUp | RigChoiceError::Rig(_) => ExitKind::Calibration,
        RigChoiceError::Form { .. } => ExitKind::Usage,
        RigChoiceError::Preset(_) | RigChoiceError::File(_) => ExitKind::Input,
    };
    Failure::new(kind, error)
}
