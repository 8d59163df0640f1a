//! Hints for input files that cannot be used.

use std::io::{self, ErrorKind};
use std::path::Path;

use failure::{ExitKind, Failure};
use geometry::files::RigFileError;

/// Returns the outcomes of all cameras, or the failure of the first camera that failed, with a hint about the other cameras that failed.
///
/// * `cameras`: names and outcomes.
///
/// # Errors
///
/// Fails if any camera failed.
pub fn of_all<T>(cameras: Vec<(&str, Result<T, Failure>)>) -> Result<Vec<T>, Failure> {
    let (mut all, mut first, mut others) = (Vec::new(), None, Vec::new());
    for (name, outcome) in cameras {
        match outcome {
            Ok(it) => all.push(it),
            Err(failure) if first.is_some() => {
                let message = failure.to_string();
                let is_named = message.contains(&format!("{name:?}"));
                others.push(if is_named {
                    message
                } else {
                    format!("{name}: {message}")
                });
            }
            Err(failure) => first = Some(failure),
        }
    }
    let Some(failure) = first else { return Ok(all) };
    if others.is_empty() {
        return Err(failure);
    }
    Err(failure.with_another_hint(format!("other cameras also fail: {}", others.join("; "))))
}

/// Returns a hint for a calibration that cannot be used; `None` if the error message suffices.
pub(crate) fn on_rig(error: &RigFileError) -> Option<String> {
    let path = match error {
        RigFileError::Read { path, source } if source.kind() == ErrorKind::PermissionDenied => {
            return Some(format!(
                "the user of Parallax must be able to read {}",
                path.display()
            ));
        }
        RigFileError::Read { path, .. } if path.is_dir() => {
            return Some("the rig must be a file, not a folder".to_owned());
        }
        RigFileError::Read { .. } | RigFileError::NoFiles => {
            return Some(
                "the rig must be a file with the poses of the cameras; `parallax calib convert` makes a rig file from the calibration of \
                 another program"
                    .to_owned(),
            );
        }
        RigFileError::Parse { path, .. } | RigFileError::UnknownFormat { path } => path,
        _ => return None,
    };
    let text = files::read_text(path, files::SETTINGS).unwrap_or_default();
    if text.trim().is_empty() {
        return Some(format!("{} is empty", path.display()));
    }
    let begins = |key: &str| text.lines().any(|line| line.starts_with(key));
    if begins("rig =") && begins("[[camera]]") {
        return Some(
            "this is a deployment file: give the file that its key `rig` names".to_owned(),
        );
    }
    None
}

/// Returns the failure to create a folder for results.
pub(crate) fn on_folder(folder: &Path, error: &io::Error) -> Failure {
    let in_the_way = folder
        .ancestors()
        .find(|folder| folder.exists())
        .filter(|folder| !folder.is_dir());
    let message = match in_the_way {
        Some(file) => format!(
            "cannot create the folder {}: {} is a file",
            folder.display(),
            file.display()
        ),
        None => format!("cannot create the folder {}: {error}", folder.display()),
    };
    Failure::new(ExitKind::Input, message)
        .with_hint("choose a folder that can be written to, with `output` in the deployment file or with --out")
}
