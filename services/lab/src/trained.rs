//! The training of a network that finds something: steps, checkpoints, curves, progress.

use std::path::{Path, PathBuf};
use std::time::Instant;

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use training::networks::{Backend, Pass, Task, TrainError, Trainer};

/// A network that was trained before.
#[derive(Debug, Clone)]
pub struct Earlier {
    /// Its file, for errors.
    pub file: PathBuf,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
}

/// A training: which file it writes, and how.
#[derive(Debug, Clone)]
pub struct Job {
    /// The ONNX file.
    pub out: PathBuf,
    /// A network that was trained before, to go on from.
    pub from: Option<Earlier>,
    /// Goes on from the checkpoint of an interrupted training.
    pub resume: bool,
    /// The library that computes.
    pub backend: Backend,
}

/// The results of some steps of a task.
type PassOf<T> = Pass<<T as Task>::Cost, <T as Task>::Score>;

/// How passes are shown.
pub(crate) struct Shown<'a, T: Task> {
    /// The curves of all passes, SVG.
    pub(crate) curves: &'a dyn Fn(&[PassOf<T>]) -> String,
    /// A pass in words, after its step.
    pub(crate) words: &'a dyn Fn(&PassOf<T>) -> String,
}

/// A file beside the one that is written.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace(path, bytes).map_err(|error| failure::in_file(path, &error))
}

/// Trains until the task is done; a checkpoint, and curves (`.svg`), follow every pass.
///
/// * `written`: the file of the trained network; the checkpoint goes when it is written.
///
/// # Errors
///
/// The checkpoint is of another training; a file cannot be written; it was stopped ([`ExitKind::Interrupted`]).
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
            let message = format!("{} is of an interrupted training", file.display());
            let hint = "go on from it with --resume, or delete it";
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
            let hint = "go on with --resume";
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
