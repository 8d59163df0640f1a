//! The files of a folder, by the numbers of their frames.

use std::fs;
use std::path::{Path, PathBuf};

use crate::files::MAX_FRAMES;

use crate::keypointfiles::error::KeypointFileError;

/// Returns the files of a folder with the numbers of their frames, counted from 0, ascending and distinct.
pub(crate) fn files(folder: &Path) -> Result<Vec<(u64, PathBuf)>, KeypointFileError> {
    let failed = |source| KeypointFileError::Read {
        path: folder.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with('.') || !name.ends_with(".json") {
            continue;
        }
        match number(&name) {
            Some(number) => files.push((number, path)),
            None => return Err(KeypointFileError::NoNumber { path }),
        }
    }
    files.sort();
    checked(folder, files)
}

fn checked(
    folder: &Path,
    mut files: Vec<(u64, PathBuf)>,
) -> Result<Vec<(u64, PathBuf)>, KeypointFileError> {
    let path = folder.to_owned();
    let (Some(&(first, _)), Some(&(last, _))) = (files.first(), files.last()) else {
        return Err(KeypointFileError::Empty { path });
    };
    if let Some([a, b]) = files.array_windows().find(|[a, b]| a.0 == b.0) {
        return Err(KeypointFileError::Twice {
            number: a.0,
            paths: [a.1.clone(), b.1.clone()],
        });
    }
    if last - first >= MAX_FRAMES {
        return Err(KeypointFileError::TooManyFrames {
            path,
            first,
            last,
            most: MAX_FRAMES,
        });
    }
    for (number, _) in &mut files {
        *number -= first;
    }
    Ok(files)
}

/// Returns the number of a frame in the name of its file: the last digits before `_keypoints.json` or `.json`.
fn number(name: &str) -> Option<u64> {
    let stem = name.strip_suffix(".json")?;
    let stem = stem.strip_suffix("_keypoints").unwrap_or(stem);
    let is_digit = |letter: char| letter.is_ascii_digit();
    let upto = &stem[..=stem.rfind(is_digit)?];
    let before = upto.trim_end_matches(is_digit);
    upto[before.len()..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_digits_of_a_file_name_are_the_frame_number() {
        for (name, expected) in [
            ("cam01_000000000012_keypoints.json", Some(12)),
            ("cam02.0024.json", Some(24)),
            ("7.json", Some(7)),
            ("frame12_rgb.json", Some(12)),
            ("é5é.json", Some(5)),
            ("keypoints.json", None),
            ("99999999999999999999999.json", None),
            ("12.txt", None),
        ] {
            assert_eq!(number(name), expected, "{name}");
        }
    }
}
