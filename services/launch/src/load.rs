//! Loads deployment files and checks them against this machine.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use capture::Blank;
use deployment::{ConfigError, Deployment, Loaded, Machine};
use failure::{ExitKind, Fault};
use scene::Address;

/// Error if a deployment cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("cannot read the deployment file {}{why}", file.display())]
    Read {
        /// Path of the file.
        file: PathBuf,
        /// Explanation why this cannot be a deployment file; empty if the system's error is sufficient.
        why: &'static str,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The content of the file is invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

impl Fault for LoadError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::Read { .. } => ExitKind::Input,
            Self::Config(_) => ExitKind::Config,
        }
    }
}

/// Reads a deployment file.
///
/// Relative paths in the file and in `set` are relative to the folder of the file.
///
/// * `set`: `key=value` pairs that replace values of the file.
///
/// # Errors
///
/// Fails if the file cannot be read, or a value is invalid.
pub fn read(file: &Path, set: &[String]) -> Result<Loaded, LoadError> {
    let text = files::read_text(file, files::SETTINGS).map_err(|source| LoadError::Read {
        file: file.to_owned(),
        why: why_not(file, &source),
        source,
    })?;
    Ok(Loaded::parse(&text, file, set, &ThisMachine)?)
}

/// Returns a loaded deployment in which some values are replaced; see [`Loaded::again`].
///
/// * `set`: `key=value` pairs that replace values.
/// * `refused`: returns the reason why a key may not be replaced, or `None` if it may.
///
/// # Errors
///
/// Fails if a key may not be replaced, or a value is invalid.
pub fn with_overrides(
    deployment: &Deployment,
    set: &[String],
    refused: impl Fn(&str) -> Option<String>,
) -> Result<Loaded, LoadError> {
    Ok(Loaded::again(deployment, set, refused, &ThisMachine)?)
}

/// Returns the default values, without a deployment file.
///
/// * `set`: `key=value` pairs that replace values.
///
/// # Errors
///
/// Fails if a value is invalid.
pub fn defaults(set: &[String]) -> Result<Loaded, LoadError> {
    Ok(Loaded::defaults(set)?)
}

/// The machine on which this process runs.
struct ThisMachine;

impl Machine for ThisMachine {
    fn folder_of(&self, file: &Path) -> PathBuf {
        let folder = file.parent().unwrap_or(Path::new(""));
        let folder = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
        std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned())
    }

    fn footage(&self, named: &str, base: &Path) -> String {
        if Address::is_address(named) {
            return Address::relative_to(named, base);
        }
        if Blank::is_blank(named) {
            return named.to_owned();
        }
        let on_disk = base.join(named);
        if named.is_empty() || (footage::is_address(named) && !on_disk.exists()) {
            return named.to_owned();
        }
        on_disk.to_string_lossy().into_owned()
    }

    fn is_live(&self, named: &str) -> bool {
        crate::cameras::is_live(named)
    }
}

/// Explains why a file is not a deployment file. Returns an empty text if the system's error is sufficient.
fn why_not(file: &Path, error: &std::io::Error) -> &'static str {
    if error.kind() == ErrorKind::InvalidData {
        ": it is not a text file (not UTF-8)"
    } else if file.is_dir() {
        ": it is a folder; pass the .toml file in it"
    } else {
        ""
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: &str = "name = 'one'\nrig = 'rig.toml'\noutput = 'out'\n\
        [[camera]]\nname = 'a'\nsource = 'a.mp4'\n";

    fn parse(set: &str) -> Result<Loaded, ConfigError> {
        let file = Path::new("deployment.toml");
        let set = [set.to_owned()];
        Loaded::parse(SHORT, file, &set, &ThisMachine)
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("/nowhere/d.toml"), &[]).unwrap_err();
        assert!(error.to_string().contains("/nowhere/d.toml"));
    }

    #[test]
    fn paths_become_absolute() {
        let deployment = parse("runtime.threads=1").unwrap().deployment;
        assert!(
            deployment.rig.is_absolute() && Path::new(&deployment.cameras[0].source).is_absolute()
        );
    }

    #[test]
    fn the_maximum_number_of_cores_equals_that_of_the_runtime() {
        assert_eq!(deployment::MAX_CORES, runtime::MAX_CORES);
    }
}
