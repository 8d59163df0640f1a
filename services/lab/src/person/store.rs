//! Files of a training: its checkpoint, and at the end the model.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use failure::{ExitKind, Failure, OrFail as _};
use fmp::Model;
use training::{Checkpoint, CheckpointBytesError, CheckpointError};

/// The files of one training. Nothing is being written while the state is not locked.
#[derive(Debug)]
pub struct Store {
    out: PathBuf,
    state: Mutex<State>,
    /// Held as long as this training runs; the system lets go of it however the process ends.
    _mine: File,
}

/// State of the files.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    n_done: usize,
    n_steps: usize,
    model_written: bool,
}

/// Why a checkpoint is of no use.
#[derive(Debug, thiserror::Error)]
enum Refused {
    #[error("cannot read the checkpoint {}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{} is no sound checkpoint", path.display())]
    Bytes {
        path: PathBuf,
        source: CheckpointBytesError,
    },
    #[error("the checkpoint {} is of a training on other image files", path.display())]
    Images { path: PathBuf },
    #[error("cannot go on from the checkpoint {}", path.display())]
    Other {
        path: PathBuf,
        source: CheckpointError,
    },
}

impl Store {
    /// Looks whether a model can be written, and whether a training was interrupted before.
    ///
    /// # Errors
    ///
    /// There is no place for the model, another training is writing it, or there is a checkpoint that the training does
    /// not continue from.
    pub fn new(out: &Path, resume: bool) -> Result<Self, Failure> {
        let wrong = |what: &str| {
            let message = format!("--out {}: {what}", out.display());
            Err(Failure::new(ExitKind::Usage, message))
        };
        if out.file_name().is_none() || out.is_dir() {
            return wrong("expected a file");
        }
        if !folder_of(out).is_dir() {
            return wrong("there is no such folder");
        }
        let store = Self {
            out: out.to_owned(),
            state: Mutex::default(),
            _mine: claim(out)?,
        };
        let checkpoint = store.checkpoint();
        if !resume && checkpoint.exists() {
            let message = format!(
                "{} is there: an earlier training was interrupted",
                checkpoint.display()
            );
            return Err(Failure::new(ExitKind::Usage, message).with_hint(
                "continue from it with --resume; to start anew, delete it or choose another --out",
            ));
        }
        Ok(store)
    }

    /// Returns the name of the model: its file without the ending.
    pub(super) fn model_name(&self) -> String {
        let stem = self.out.file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Reads the checkpoint, if there is one.
    ///
    /// # Errors
    ///
    /// It is damaged, or was made with other image files.
    pub(super) fn load(&self, stamp: u64) -> Result<Option<Checkpoint>, Failure> {
        let path = self.checkpoint();
        let bytes = match files::read(&path, files::RESULTS) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            other => other,
        };
        let bytes = bytes.map_err(|source| {
            let path = path.clone();
            self.with_advice(Refused::Io { path, source })
        })?;
        let read = Checkpoint::from_bytes(&bytes).map_err(|source| {
            let path = path.clone();
            self.with_advice(Refused::Bytes { path, source })
        });
        let (checkpoint, of) = read?;
        if of == stamp {
            Ok(Some(checkpoint))
        } else {
            Err(self.with_advice(Refused::Images { path }))
        }
    }

    /// A checkpoint that does not fit the training.
    pub(super) fn refused(&self, source: CheckpointError) -> Failure {
        let path = self.checkpoint();
        self.with_advice(Refused::Other { path, source })
    }

    fn with_advice(&self, refused: Refused) -> Failure {
        let path = self.checkpoint();
        Failure::new(ExitKind::Input, refused).with_hint(format!(
            "--resume needs the data sets, negatives, options and settings that it was made with; to \
             begin anew, delete {}",
            path.display()
        ))
    }

    /// Takes note of where a training goes on.
    pub(super) fn resumed(&self, n_done: usize, n_steps: usize) {
        let mut state = self.lock();
        (state.n_done, state.n_steps) = (n_done, n_steps);
    }

    /// Writes the checkpoint: it is complete, or the one before it stays.
    ///
    /// # Errors
    ///
    /// Those of the operating system.
    pub(super) fn save(
        &self,
        checkpoint: &Checkpoint,
        stamp: u64,
        n_steps: usize,
    ) -> Result<(), Failure> {
        let bytes = checkpoint.to_bytes(stamp).or_fail(ExitKind::Run)?;
        let path = self.checkpoint();
        let mut state = self.lock();
        files::replace(&path, &bytes).map_err(|error| {
            let message = format!("cannot write the checkpoint {}: {error}", path.display());
            Failure::new(ExitKind::Run, message)
        })?;
        (state.n_done, state.n_steps) = (checkpoint.n_done(), n_steps);
        Ok(())
    }

    /// Writes the model, and removes the checkpoint, which is of no use any more.
    ///
    /// # Errors
    ///
    /// Those of the operating system.
    pub(super) fn finish(&self, model: &Model) -> Result<(), Failure> {
        let mut state = self.lock();
        fmp::files::write(&self.out, model).or_fail(ExitKind::Run)?;
        state.model_written = true;
        let path = self.checkpoint();
        fs::remove_file(&path).map_err(|error| {
            let message = format!("cannot remove the checkpoint {}: {error}", path.display());
            Failure::new(ExitKind::Run, message)
        })
    }

    /// How a training that was stopped ends: what is left of it, and how to go on. Waits for what is
    /// being written.
    pub fn interrupted(&self) -> Failure {
        let state = self.lock();
        self.let_go();
        let State {
            n_done,
            n_steps,
            model_written,
        } = *state;
        // Never unlocked again: nothing is to be written any more.
        core::mem::forget(state);
        let stopped = |what: String| Failure::new(ExitKind::Interrupted, what);
        if model_written {
            let out = self.out.display();
            return stopped(format!("stopped after the model {out} was written"));
        }
        let path = self.checkpoint();
        let so_far = match n_done {
            0 => stopped("stopped before a step was done".to_owned()),
            _ => stopped(format!("stopped after {n_done} of {n_steps} steps")),
        };
        if !path.exists() {
            return so_far
                .with_hint("nothing is kept: the first checkpoint is written after a step");
        }
        let path = path.display();
        so_far.with_hint(format!(
            "the same command with --resume goes on from {path}"
        ))
    }

    fn checkpoint(&self) -> PathBuf {
        let mut name = OsString::from(self.out.file_name().unwrap_or_default());
        name.push(".checkpoint");
        self.out.with_file_name(name)
    }

    /// Tidies up the file that said whose the model is; without it nothing is lost.
    fn let_go(&self) {
        drop(fs::remove_file(claim_of(&self.out)));
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.let_go();
    }
}

fn claim_of(out: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(out.file_name().unwrap_or_default());
    name.push(".lock");
    out.with_file_name(name)
}

/// Makes sure that no other training writes the same model.
fn claim(out: &Path) -> Result<File, Failure> {
    let path = claim_of(out);
    let file = files::Folder::open(folder_of(out))
        .and_then(|folder| folder.reopen(&path.file_name().unwrap_or_default().to_string_lossy()))
        .map_err(|error| {
            let message = format!("cannot write {}: {error}", path.display());
            Failure::new(ExitKind::Usage, message)
        })?;
    match file.try_lock() {
        // A file system that cannot lock is no reason not to train.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let message = format!("--out {}: another training is writing it", out.display());
            Err(Failure::new(ExitKind::Usage, message)
                .with_hint("wait for it, or write to another --out"))
        }
    }
}

/// The folder that a file lies in, as the operating system wants it named.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests;
