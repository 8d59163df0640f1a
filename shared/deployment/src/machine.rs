//! Queries to the machine, so that this crate does not access it directly.

use std::path::{Path, PathBuf};

/// The machine that a deployment is loaded on.
pub trait Machine {
    /// Returns the folder of a file, as an absolute path if the working folder is known.
    fn folder_of(&self, file: &Path) -> PathBuf;

    /// Returns the source of footage with its path resolved against `base`, the folder of the file that names it. A name that is
    /// not a file is returned unchanged; the run refuses it later.
    fn footage(&self, named: &str, base: &Path) -> String;

    /// Returns true if a source is a live camera.
    ///
    /// * `named`: the source, as returned by [`Self::footage`].
    fn is_live(&self, named: &str) -> bool;
}

/// A machine that treats all footage as files, for tests and for tools that only inspect a deployment file.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnyMachine;

impl Machine for AnyMachine {
    fn folder_of(&self, file: &Path) -> PathBuf {
        file.parent().unwrap_or(Path::new("")).to_owned()
    }

    fn footage(&self, named: &str, base: &Path) -> String {
        base.join(named).to_string_lossy().into_owned()
    }

    fn is_live(&self, _named: &str) -> bool {
        false
    }
}
