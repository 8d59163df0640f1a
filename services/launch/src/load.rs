//! Deployment files from the disk, checked against this machine.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use deployment::pose::Precision;
use deployment::{ConfigError, Deployment, Loaded, Machine};
use runtime::{ExitKind, Fault};
use scene::Address;

/// Why there is no deployment.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("cannot read the deployment file {}{why}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What it is instead, where the words of the system do not tell.
        why: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// What it holds is wrong.
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

/// Reads a deployment file; `set` are `key=value` pairs that replace what it says.
///
/// Relative paths are relative to the file, whoever gives them.
///
/// # Errors
///
/// The file cannot be read, or what it holds is wrong.
pub fn read(file: &Path, set: &[String]) -> Result<Loaded, LoadError> {
    let text = fs::read_to_string(file).map_err(|source| LoadError::Read {
        file: file.to_owned(),
        why: why_not(file, &source),
        source,
    })?;
    Ok(Loaded::parse(&text, file, set, &ThisMachine)?)
}

/// A deployment that was read before, with other values; see [`Loaded::again`].
///
/// # Errors
///
/// A value is refused, or wrong.
pub fn again(
    deployment: &Deployment,
    set: &[String],
    refused: impl Fn(&str) -> Option<String>,
) -> Result<Loaded, LoadError> {
    Ok(Loaded::again(deployment, set, refused, &ThisMachine)?)
}

/// The defaults alone.
///
/// # Errors
///
/// A value is wrong.
pub fn defaults(set: &[String]) -> Result<Loaded, LoadError> {
    Ok(Loaded::defaults(set)?)
}

/// The machine that this process runs on.
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
        let on_disk = base.join(named);
        if named.is_empty() || (footage::is_live(named) && !on_disk.exists()) {
            return named.to_owned();
        }
        on_disk.to_string_lossy().into_owned()
    }

    fn has(&self, precision: Precision) -> Result<(), String> {
        let checked = pose::precision(precision).check();
        checked.map_err(|why| why.to_string())
    }
}

/// What the file is instead, where the words of the system do not tell.
fn why_not(file: &Path, error: &std::io::Error) -> &'static str {
    if error.kind() == ErrorKind::InvalidData {
        ": it is no text (not UTF-8)"
    } else if file.is_dir() {
        ": it is a folder; name the .toml file in it"
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
        Loaded::parse(SHORT, file, &[set.to_owned()], &ThisMachine)
    }

    #[test]
    fn a_precision_that_the_machine_lacks_is_refused_with_what_it_lacks() {
        let set = "pose.precision=bf16";
        match kernels::Amx::detect() {
            Ok(_) => {
                let pose = parse(set).unwrap().deployment.pose;
                assert_eq!(pose.precision, Precision::Bf16);
            }
            Err(why) => {
                let got = parse(set).unwrap_err().to_string();
                assert!(got.contains("`pose.precision` is \"bf16\""), "{got}");
                assert!(got.contains(&why.to_string()), "{got}");
            }
        }
        let got = parse("pose.precision=f16").unwrap_err().to_string();
        assert!(got.contains("`bf16`"), "{got}");
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = read(Path::new("/nowhere/d.toml"), &[]).unwrap_err();
        assert!(error.to_string().contains("/nowhere/d.toml"));
    }

    #[test]
    fn paths_become_absolute() {
        let it = parse("pose.threads=1").unwrap().deployment;
        assert!(it.rig.is_absolute() && Path::new(&it.cameras[0].source).is_absolute());
    }

    #[test]
    fn cores_are_numbered_as_the_system_numbers_them() {
        assert_eq!(deployment::MAX_CORES, runtime::MAX_CORES);
    }
}
