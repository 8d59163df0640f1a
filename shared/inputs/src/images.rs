//! Image files that a user names, individually or by their folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, in_file};

/// Returns the named images; images in a folder are in the order of their names.
///
/// # Errors
///
/// Fails if a folder cannot be read, or contains no image.
pub fn listed(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut images = Vec::new();
    for path in named {
        if !path.is_dir() {
            images.push(path.clone());
            continue;
        }
        let wrong = |error: io::Error| in_file(path, &error);
        let mut inside = Vec::new();
        for entry in fs::read_dir(path).map_err(wrong)? {
            inside.push(entry.map_err(wrong)?.path());
        }
        inside.retain(|path| has_image_name(path));
        inside.sort();
        if inside.is_empty() {
            let message = format!("{}: no image (png, jpg, jpeg, bmp) in it", path.display());
            return Err(Failure::new(ExitKind::Input, message));
        }
        images.append(&mut inside);
    }
    Ok(images)
}

/// Returns true if a file has the name of an image.
pub fn has_image_name(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    ["png", "jpg", "jpeg", "bmp"]
        .iter()
        .any(|name| extension.eq_ignore_ascii_case(name))
}
