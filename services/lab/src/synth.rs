//! Sequences of people who do not exist, with the truth: pictures, masks, rigs, annotations, deployments.

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

/// Who does what before which cameras, and what is written of it.
#[derive(Debug)]
pub struct Job {
    /// The folder to write; it is there, and empty.
    pub out: PathBuf,
    /// The cameras.
    pub rig: RigChoice,
    /// Numbers of the subjects.
    pub subjects: Vec<u64>,
    /// How many other people stand around.
    pub others: u64,
    /// How many people walk and pass the subject.
    pub passers: u64,
    /// Actions of the people, one after the other; unused with `recording`.
    pub actions: Vec<Action>,
    /// Recorded motion in the place of an action.
    pub recording: Option<Recording>,
    /// Seed of the performance, the room and the lamps.
    pub seed: u64,
    /// Frames of every camera.
    pub n_frames: u64,
    /// Frames a second.
    pub rate_hz: f64,
    /// How pictures are stored.
    pub format: Format,
    /// True if masks are written.
    pub with_masks: bool,
    /// Folder of photographs that stand in the place of a room.
    pub backdrop: Option<PathBuf>,
    /// The model that the deployment names; none if not given.
    pub model: Option<PathBuf>,
    /// True if no pictures are written, and cameras of the deployment make them while it runs.
    pub live: bool,
    /// Flaws of the cameras.
    pub flaws: Flaws,
    /// How long after the instants of the frames every camera takes its pictures, milliseconds; at most one for each of the rig.
    pub skews_ms: Vec<f64>,
}

/// All sequences that were written.
#[derive(Debug)]
pub struct Done {
    /// The sequences, subject by subject.
    pub sequences: Vec<Written>,
    /// How long it took.
    pub seconds: f64,
}

/// A sequence that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Where it is.
    pub folder: PathBuf,
    /// Number of the subject.
    pub subject: u64,
    /// Action of the subject.
    pub action: String,
    /// Seed of the performance, the room and the lamps.
    pub seed: u64,
    /// Pictures of all cameras; those that cameras make later, too.
    pub n_pictures: u64,
    /// People who were annotated.
    pub n_people: usize,
}

impl Written {
    /// For programs.
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
/// One sequence lies in the folder itself, several in folders of it, with the annotated people of all beside them.
///
/// # Errors
///
/// A rig, a backdrop or a flaw that cannot be used; a file that cannot be written; a stop request
/// ([`ExitKind::Interrupted`]).
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
    /// The actions, one of which stands for what was recorded.
    fn actions(&self) -> &[Action] {
        match self.recording {
            Some(_) => &[Action::Walking],
            None => &self.actions,
        }
    }

    fn n_sequences(&self) -> usize {
        self.subjects.len() * self.actions().len()
    }

    /// The name of a sequence.
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

/// A rig that is found from any working folder.
fn absolute(rig: &RigChoice) -> RigChoice {
    match rig {
        RigChoice::File(path) => RigChoice::File(absolute_path(path)),
        other => other.clone(),
    }
}

fn absolute_path(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// A missing rig is a failure of the input; a rig without an upward direction cannot be used.
pub fn rig_failure(error: RigChoiceError) -> Failure {
    let kind = match error {
        RigChoiceError::NoUp | RigChoiceError::Rig(_) => ExitKind::Calibration,
        RigChoiceError::Form { .. } => ExitKind::Usage,
        RigChoiceError::Preset(_) | RigChoiceError::File(_) => ExitKind::Input,
    };
    Failure::new(kind, error)
}
