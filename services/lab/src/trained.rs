//! Training of a network that finds people or joints: steps, checkpoints, curves, progress.

use std::path::{Path, PathBuf};
use std::time::Instant;

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use training::networks::{About, Backend, BeginError, Parameter, Pass, Task, TrainError, Trainer};

/// A network from an earlier training.
#[derive(Debug, Clone)]
pub struct Earlier {
    /// File of the network, for error messages.
    pub file: PathBuf,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

/// Output file and options of a training.
#[derive(Debug, Clone)]
pub struct Job {
    /// The ONNX file to write.
    pub out: PathBuf,
    /// Network from an earlier training to start from.
    pub from: Option<Earlier>,
    /// True to continue from the checkpoint of an interrupted training.
    pub resume: bool,
    /// The library that computes.
    pub backend: Backend,
}

/// Results of a pass (a group of training steps) of a task.
type PassOf<T> = Pass<<T as Task>::Cost, <T as Task>::Score>;

/// Functions that display passes.
pub(crate) struct Shown<'a, T: Task> {
    /// Draws the curves of all passes as SVG.
    pub(crate) curves: &'a dyn Fn(&[PassOf<T>]) -> String,
    /// Describes a pass in a line of text, which follows the number of the step.
    pub(crate) words: &'a dyn Fn(&PassOf<T>) -> String,
}

/// Reads the parameters of the network to start from; `None` for random parameters.
///
/// * `command`: the command that made the network, for the hint.
pub(crate) fn begun(
    job: &Job,
    command: &str,
    read: impl FnOnce(&[u8]) -> Result<Vec<Parameter>, BeginError>,
) -> Result<Option<Vec<Parameter>>, Failure> {
    let begun = |from: &Earlier| {
        read(&from.bytes).map_err(|error| {
            let hint = format!(
                "--from needs a network made by `{command}`, with the same `shape` as in the settings"
            );
            failure::in_file(&from.file, &error).with_hint(hint)
        })
    };
    job.from.as_ref().map(begun).transpose()
}

/// Describes a training for the card of its network.
///
/// * `examples`: training examples and held-out examples.
pub(crate) fn about<T: Task<Score: Default>, E>(
    job: &Job,
    trainer: &Trainer<T>,
    (examples, samples): ([&[E]; 2], usize),
) -> About<T::Score> {
    let score = trainer.passes().iter().rev().find_map(|pass| pass.score);
    About {
        examples: examples.map(<[_]>::len),
        samples,
        goes_on: job.from.is_some(),
        score: score.unwrap_or_default(),
    }
}

/// Returns the path of a file beside the output file.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace(path, bytes).map_err(|error| failure::in_file(path, &error))
}

/// Trains until the task is done. After every pass, a checkpoint and the curves (`.svg`) are written.
///
/// * `written`: returns the content of the network's file; the checkpoint is removed after this file is written.
///
/// # Errors
///
/// Fails if the checkpoint is from another training, if a file cannot be written, or on a stop request ([`ExitKind::Interrupted`]).
pub(crate) fn run<T: Task>(
    job: &Job,
    task: T,
    shown: &Shown<'_, T>,
    written: &dyn Fn(&Trainer<T>) -> Vec<u8>,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<PassOf<T>>, Failure> {
    let file = beside(&job.out, ".checkpoint");
    let kept = match files::read(&file, files::RESULTS) {
        Ok(bytes) if job.resume => Some(bytes),
        Ok(_) => {
            let message = format!("{} was left by an interrupted training", file.display());
            let hint = "continue from it with --resume, or delete it";
            return Err(Failure::new(ExitKind::Usage, message).with_hint(hint));
        }
        Err(_) => None,
    };
    let n_steps = task.n_steps();
    let trainer = Trainer::new(task, job.backend, kept.as_deref());
    let mut trainer = trainer.map_err(|error| {
        let kind = match error {
            TrainError::Precision => ExitKind::Config,
            TrainError::Checkpoint(_) | TrainError::Other { .. } => ExitKind::Input,
        };
        Failure::new(kind, error)
    })?;
    let (began, from) = (Instant::now(), trainer.step());
    while !trainer.is_done() {
        if !trainer.pass(&mut |_| !stop.is_requested()) {
            let message = format!("stopped after step {}", trainer.step());
            let hint = "continue with --resume";
            return Err(Failure::new(ExitKind::Interrupted, message).with_hint(hint));
        }
        write(&file, &trainer.checkpoint().or_fail(ExitKind::Run)?)?;
        let curves = (shown.curves)(trainer.passes());
        write(&beside(&job.out, ".svg"), curves.as_bytes())?;
        if let Some(pass) = trainer.passes().last() {
            let done = (trainer.step() - from) as f64;
            let left = (n_steps - trainer.step()) as f64;
            let minutes = began.elapsed().as_secs_f64() / 60.0 * left / done;
            let words = (shown.words)(pass);
            console.message(&format!(
                "step {} of {n_steps}, {minutes:.0} minutes left: {words}",
                pass.step
            ));
        }
    }
    write(&job.out, &written(&trainer))?;
    std::fs::remove_file(&file).map_err(|error| failure::in_file(&file, &error))?;
    Ok(trainer.passes().to_vec())
}
