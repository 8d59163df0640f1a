//! Questions to the machine, so that this crate need not touch it.

use std::path::{Path, PathBuf};

/// Answers of the machine that a deployment is loaded on.
pub trait Machine {
    /// The folder of a file, absolute where the working folder is known.
    fn folder_of(&self, file: &Path) -> PathBuf;

    /// Footage as it is named in a file of the folder `base`, its path resolved. A name that is no file stays as it
    /// is: the run refuses it.
    fn footage(&self, named: &str, base: &Path) -> String;

    /// Returns true if footage is a live camera.
    ///
    /// * `named`: as [`Self::footage`] returned it.
    fn is_live(&self, named: &str) -> bool;
}

/// A machine that has everything, and on which all footage is files: for tests, and for tools that only look at a file.
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
