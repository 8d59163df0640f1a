//! One writer at a time: an output folder belongs to whoever writes there.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::Path;

use runtime::{ExitKind, Failure};

use runtime::in_file;

/// The file in the folder that is locked. It stays: only its lock says that somebody writes, and that ends with the
/// process, however it ends.
const FILE: &str = ".parallax.lock";

/// The right to write to a folder, as long as it lives.
#[derive(Debug)]
pub struct Claim {
    /// None where the file system cannot lock, which is no reason not to run.
    _file: Option<File>,
}

impl Claim {
    /// Claims a folder, which is made if it is not there.
    ///
    /// * `what`: who claims it, for whoever comes second.
    ///
    /// # Errors
    ///
    /// The folder cannot be made or written to, or somebody else writes there, who is named.
    pub fn of(folder: &Path, what: &str) -> Result<Self, Failure> {
        let in_folder = |error: &std::io::Error| in_file(folder, error);
        std::fs::create_dir_all(folder).map_err(|error| in_folder(&error))?;
        let path = folder.join(FILE);
        let mut options = OpenOptions::new();
        let options = options.create(true).truncate(false).read(true).write(true);
        let mut file = options
            .open(&path)
            .map_err(|error| in_file(&path, &error))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::Error(_)) => return Ok(Self { _file: None }),
            Err(TryLockError::WouldBlock) => return Err(taken(folder, &mut file)),
        }
        let told = file
            .set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| writeln!(file, "process {}, {what}", std::process::id()));
        told.map_err(|error| in_file(&path, &error))?;
        Ok(Self { _file: Some(file) })
    }
}

fn taken(folder: &Path, file: &mut File) -> Failure {
    let mut who = String::new();
    // Who has only just claimed it has not said its name yet.
    if file.read_to_string(&mut who).is_err() || who.trim().is_empty() {
        "another process".clone_into(&mut who);
    }
    let message = format!("{} is being written to by {}", folder.display(), who.trim());
    Failure::new(ExitKind::Config, message)
        .with_hint("wait until it ends, or name another output folder")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_writer_who_is_named_and_a_dead_one_does_not_count() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("out");
        let first = Claim::of(&folder, "deployment room").unwrap();
        let refused = Claim::of(&folder, "deployment hall")
            .unwrap_err()
            .to_string();
        let who = format!("process {}, deployment room", std::process::id());
        assert!(refused.contains(&who), "{refused}");
        drop(first);
        Claim::of(&folder, "deployment hall").unwrap();
    }
}
