//! Exclusive access to an output folder.

use std::fs::{File, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::Path;

use crate::{ExitKind, Failure, in_file};

/// Name of the lock file in the folder. The file is never removed: only the lock on it matters, and the system releases the lock when the
/// process ends.
const FILE: &str = ".parallax.lock";

/// Exclusive write access to a folder; released when dropped.
#[derive(Debug)]
pub struct Claim {
    /// `None` if the file system does not support locks; the run then continues without a lock.
    _file: Option<File>,
}

impl Claim {
    /// Claims a folder. Creates it if it does not exist.
    ///
    /// * `owner`: name of this process, shown in the error message of another process that tries to claim the folder.
    ///
    /// # Errors
    ///
    /// Fails if the folder cannot be created or written to, or if another process has claimed it. The message names that process.
    pub fn take(folder: &Path, owner: &str) -> Result<Self, Failure> {
        let opened = files::Folder::create(folder).map_err(|error| in_file(folder, &error))?;
        if let Some(risk) = opened.risk().map_err(|error| in_file(folder, &error))? {
            tracing::warn!(
                folder = %folder.display(),
                "the output folder {risk}: other users can change or remove the results in it"
            );
        }
        let path = folder.join(FILE);
        let mut file = opened.reopen(FILE).map_err(|error| in_file(&path, &error))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::Error(_)) => return Ok(Self { _file: None }),
            Err(TryLockError::WouldBlock) => return Err(taken(folder, &mut file)),
        }
        let written = file
            .set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| writeln!(file, "process {}, {owner}", std::process::id()));
        written.map_err(|error| in_file(&path, &error))?;
        Ok(Self { _file: Some(file) })
    }
}

/// Fails if another process has claimed a folder.
///
/// # Errors
///
/// The message names the process that has claimed the folder.
pub fn check_claim(folder: &Path) -> Result<(), Failure> {
    let Ok(mut file) = files::open(&folder.join(FILE)) else {
        return Ok(());
    };
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Err(taken(folder, &mut file)),
        _ => Ok(()),
    }
}

fn taken(folder: &Path, file: &mut File) -> Failure {
    let mut owner = String::new();
    // The owner may not have written its name yet.
    if file.read_to_string(&mut owner).is_err() || owner.trim().is_empty() {
        "another process".clone_into(&mut owner);
    }
    let message = format!(
        "{} is being written to by {}",
        folder.display(),
        owner.trim()
    );
    Failure::new(ExitKind::Config, message)
        .with_hint("wait until that process ends, or name another output folder")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_claim_names_the_owner_and_a_released_folder_can_be_claimed() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("out");
        let first = Claim::take(&folder, "deployment room").unwrap();
        let refused = Claim::take(&folder, "deployment hall").unwrap_err().to_string();
        let owner = format!("process {}, deployment room", std::process::id());
        assert!(refused.contains(&owner), "{refused}");
        drop(first);
        Claim::take(&folder, "deployment hall").unwrap();
    }
}
