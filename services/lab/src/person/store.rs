//! Files of a training: its checkpoint, and finally the model.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use failure::{ExitKind, Failure, OrFail as _};
use fmp::Model;
use training::{Checkpoint, CheckpointBytesError, CheckpointError};

/// Files of one training. The state is locked while a file is being written.
#[derive(Debug)]
pub struct Store {
    out: PathBuf,
    state: Mutex<State>,
    /// Lock that is held during this training; the operating system releases it when the process ends.
    _mine: File,
}

/// State of the files.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    n_done: usize,
    n_steps: usize,
    model_written: bool,
}

/// Reason why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
enum Refused {
    #[error("cannot read the checkpoint {}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{} is not a valid checkpoint", path.display())]
    Bytes {
        path: PathBuf,
        source: CheckpointBytesError,
    },
    #[error("the checkpoint {} is from a training with other image files", path.display())]
    Images { path: PathBuf },
    #[error("cannot continue from the checkpoint {}", path.display())]
    Other {
        path: PathBuf,
        source: CheckpointError,
    },
}

impl Store {
    /// Checks whether the model can be written, and whether an earlier training was interrupted.
    ///
    /// # Errors
    ///
    /// Fails if the path of the model is not a file in an existing folder, if another training is writing it, or if there is a checkpoint
    /// that the training does not continue from.
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
                "{} exists: an earlier training was interrupted",
                checkpoint.display()
            );
            return Err(Failure::new(ExitKind::Usage, message).with_hint(
                "continue from it with --resume; to start from the beginning, delete it or choose another --out",
            ));
        }
        Ok(store)
    }

    /// Returns the name of the model: its file name without the extension.
    pub(super) fn model_name(&self) -> String {
        let stem = self.out.file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Reads the checkpoint, if there is one.
    ///
    /// # Errors
    ///
    /// Fails if the checkpoint is damaged, or was made with other image files.
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

    /// Returns the failure for a checkpoint that does not fit the training.
    pub(super) fn refused(&self, source: CheckpointError) -> Failure {
        let path = self.checkpoint();
        self.with_advice(Refused::Other { path, source })
    }

    fn with_advice(&self, refused: Refused) -> Failure {
        let path = self.checkpoint();
        Failure::new(ExitKind::Input, refused).with_hint(format!(
            "--resume needs the data sets, negatives, options and settings of the interrupted training; to start from the beginning, \
             delete {}",
            path.display()
        ))
    }

    /// Records the step at which a training continues.
    pub(super) fn resumed(&self, n_done: usize, n_steps: usize) {
        let mut state = self.lock();
        (state.n_done, state.n_steps) = (n_done, n_steps);
    }

    /// Writes the checkpoint completely, or keeps the previous checkpoint.
    ///
    /// # Errors
    ///
    /// Fails with errors of the operating system.
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

    /// Writes the model, and removes the checkpoint, which is no longer needed.
    ///
    /// # Errors
    ///
    /// Fails with errors of the operating system.
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

    /// Waits until the current file is written, and returns the failure for a stopped training. The hint of the failure explains how to
    /// continue.
    pub fn interrupted(&self) -> Failure {
        let state = self.lock();
        self.let_go();
        let State {
            n_done,
            n_steps,
            model_written,
        } = *state;
        // The state remains locked, so that no more files are written.
        core::mem::forget(state);
        let stopped = |what: String| Failure::new(ExitKind::Interrupted, what);
        if model_written {
            let out = self.out.display();
            return stopped(format!("stopped after the model {out} was written"));
        }
        let path = self.checkpoint();
        let so_far = match n_done {
            0 => stopped("stopped before the first step was done".to_owned()),
            _ => stopped(format!("stopped after {n_done} of {n_steps} steps")),
        };
        if !path.exists() {
            return so_far.with_hint(
                "there is no checkpoint yet: the first checkpoint is written after the first step",
            );
        }
        let path = path.display();
        so_far.with_hint(format!(
            "the same command with --resume continues from {path}"
        ))
    }

    fn checkpoint(&self) -> PathBuf {
        let mut name = OsString::from(self.out.file_name().unwrap_or_default());
        name.push(".checkpoint");
        self.out.with_file_name(name)
    }

    /// Removes the lock file, if possible. Its only purpose was to reserve the path of the model.
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
        // If the file system does not support locks, the training continues without a lock.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let message = format!(
                "--out {}: another training is writing this file",
                out.display()
            );
            Err(Failure::new(ExitKind::Usage, message)
                .with_hint("wait until that training ends, or choose another --out"))
        }
    }
}

/// Returns the folder of a file, in a form that the operating system accepts.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests;
