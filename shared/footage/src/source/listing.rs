//! Finds the files that a path stands for, and their order.

use std::cmp::Ordering;
use std::ffi::OsStr;
use std::fs::Metadata;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::live;
use super::password::without_passwords;
use crate::FootageError;

/// Files that a path stands for.
#[derive(Debug, PartialEq)]
pub(super) enum Listing {
    /// One file, which may be an image or a video.
    File(PathBuf),
    /// The images of a sequence, in order; at least one image.
    Images(Vec<PathBuf>),
}

/// Finds the files of `path`: the file or folder of this name if there is one, otherwise the files that match it as a numbered pattern or a
/// glob.
pub(super) fn list(path: &str) -> Result<Listing, FootageError> {
    if path.is_empty() {
        return Err(FootageError::NoName);
    }
    let as_is = Path::new(path);
    let metadata = metadata_of(as_is)?;
    if metadata.as_ref().is_some_and(Metadata::is_file) {
        return Ok(Listing::File(as_is.to_path_buf()));
    }
    let images = if metadata.as_ref().is_some_and(Metadata::is_dir) {
        files_of(as_is, is_image_name)?
    } else if let Some(what) = metadata
        .map(|metadata| live::kind(metadata.file_type()))
        .or_else(|| live::what(path))
    {
        return Err(FootageError::Live {
            path: without_passwords(path),
            what,
            instead: without_passwords(&live::instead(path)),
        });
    } else if let Some(numbered) = Numbered::parse(as_is) {
        numbered.files()?
    } else if path.contains(['*', '?', '[']) {
        matches_of(path)?
    } else {
        return Err(absent(path));
    };
    if images.is_empty() {
        return Err(FootageError::NoImages {
            path: path.to_owned(),
        });
    }
    Ok(Listing::Images(images))
}

/// Returns the metadata of a path; `None` if it does not exist.
fn metadata_of(path: &Path) -> Result<Option<Metadata>, FootageError> {
    match std::fs::metadata(path) {
        Ok(metadata) => Ok(Some(metadata)),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Err(FootageError::Io {
            path: path.to_path_buf(),
            source: error,
        }),
        Err(_absent) => Ok(None),
    }
}

fn absent(path: &str) -> FootageError {
    let path = path.to_owned();
    if path.contains(char::REPLACEMENT_CHARACTER) {
        FootageError::NotUtf8 { path }
    } else if path.starts_with("/dev/") {
        FootageError::Live {
            instead: live::instead(&path),
            path,
            what: "a device that is not there",
        }
    } else {
        FootageError::NotFound { path }
    }
}

/// Returns the files of a folder for which `wanted` returns true, in natural order of their names.
fn files_of(folder: &Path, wanted: impl Fn(&OsStr) -> bool) -> Result<Vec<PathBuf>, FootageError> {
    let read = || -> std::io::Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            if path.file_name().is_some_and(&wanted) && path.is_file() {
                files.push(path);
            }
        }
        Ok(files)
    };
    let mut files = read().map_err(|source| FootageError::Io {
        path: folder.to_path_buf(),
        source,
    })?;
    sort_naturally(&mut files);
    Ok(files)
}

fn is_image_name(name: &OsStr) -> bool {
    let path = Path::new(name);
    let hidden = name.to_string_lossy().starts_with('.');
    !hidden
        && path.extension().is_some_and(|extension| {
            ["png", "jpg", "jpeg", "bmp"]
                .iter()
                .any(|known| extension.eq_ignore_ascii_case(known))
        })
}

fn matches_of(pattern: &str) -> Result<Vec<PathBuf>, FootageError> {
    let options = glob::MatchOptions {
        require_literal_leading_dot: true,
        ..glob::MatchOptions::new()
    };
    let paths = glob::glob_with(pattern, options).map_err(|source| FootageError::BadPattern {
        pattern: pattern.to_owned(),
        source,
    })?;
    let mut files = Vec::new();
    for path in paths {
        let path = path.map_err(|error| FootageError::Io {
            path: error.path().to_path_buf(),
            source: error.into(),
        })?;
        if path.is_file() {
            files.push(path);
        }
    }
    sort_naturally(&mut files);
    Ok(files)
}

/// A file name that contains a number, such as `im%05d.png`.
struct Numbered<'a> {
    folder: &'a Path,
    prefix: &'a str,
    suffix: &'a str,
}

impl<'a> Numbered<'a> {
    fn parse(path: &'a Path) -> Option<Self> {
        let (prefix, rest) = path.file_name()?.to_str()?.split_once('%')?;
        let (width, suffix) = rest.split_once('d')?;
        let folder = match path.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let is_width = width.bytes().all(|byte| byte.is_ascii_digit());
        is_width.then_some(Self {
            folder,
            prefix,
            suffix,
        })
    }

    /// Returns the files that have any number in place of the pattern, in the order of their numbers. Gaps do not end the sequence.
    fn files(&self) -> Result<Vec<PathBuf>, FootageError> {
        files_of(self.folder, |name| {
            name.to_str()
                .and_then(|name| name.strip_prefix(self.prefix)?.strip_suffix(self.suffix))
                .is_some_and(|number| {
                    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
                })
        })
    }
}

fn sort_naturally(paths: &mut [PathBuf]) {
    paths.sort_by(|a, b| {
        natural_order(&a.to_string_lossy(), &b.to_string_lossy()).then_with(|| a.cmp(b))
    });
}

/// Compares in natural order: runs of digits by their value, and all other text by character.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let ((head_a, rest_a), (head_b, rest_b)) = (split_run(a), split_run(b));
        if head_a.is_empty() || head_b.is_empty() {
            return head_a.len().cmp(&head_b.len());
        }
        let order = match (value_of(head_a), value_of(head_b)) {
            (Some(x), Some(y)) => x.len().cmp(&y.len()).then_with(|| x.cmp(y)),
            _ => head_a.cmp(head_b),
        };
        if order != Ordering::Equal {
            return order;
        }
        (a, b) = (rest_a, rest_b);
    }
}

/// Splits a text into runs of digits and runs of other characters.
pub(super) fn runs(mut text: &str) -> Vec<&str> {
    let mut all = Vec::new();
    while !text.is_empty() {
        let (run, rest) = split_run(text);
        all.push(run);
        text = rest;
    }
    all
}

/// Splits off the leading run of digits or of other characters, and returns the run and the rest.
fn split_run(text: &str) -> (&str, &str) {
    let is_number = text.starts_with(|letter: char| letter.is_ascii_digit());
    let end = text
        .find(|letter: char| letter.is_ascii_digit() != is_number)
        .unwrap_or(text.len());
    text.split_at(end)
}

/// Returns the digits without leading zeros, of any length. They compare by length and then by character.
fn value_of(run: &str) -> Option<&str> {
    run.starts_with(|letter: char| letter.is_ascii_digit())
        .then(|| run.trim_start_matches('0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(names: &[&str]) -> Vec<String> {
        let mut paths: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
        sort_naturally(&mut paths);
        let text = |path: &PathBuf| path.to_string_lossy().into_owned();
        paths.iter().map(text).collect()
    }

    #[test]
    fn numbers_in_names_compare_by_value() {
        assert_eq!(
            sorted(&["im10.png", "im2.png", "im1.png"]),
            ["im1.png", "im2.png", "im10.png"]
        );
        assert_eq!(
            sorted(&["a2b10", "a10b1", "a2b9"]),
            ["a2b9", "a2b10", "a10b1"]
        );
        assert_eq!(sorted(&["b1", "a2", "a"]), ["a", "a2", "b1"]);
    }

    #[test]
    fn numbers_longer_than_any_integer_still_compare_by_value() {
        let (small, large) = ("9".repeat(40), format!("1{}", "0".repeat(40)));
        assert_eq!(natural_order(&small, &large), Ordering::Less);
    }

    #[test]
    fn leading_zeros_do_not_change_the_value_but_decide_ties() {
        assert_eq!(sorted(&["im2", "im01", "im001"]), ["im001", "im01", "im2"]);
    }

    #[test]
    fn only_a_percent_sign_with_digits_and_d_is_a_numbered_pattern() {
        let parse =
            |name| Numbered::parse(Path::new(name)).map(|value| (value.prefix, value.suffix));
        assert_eq!(parse("x/im%05d.png"), Some(("im", ".png")));
        assert_eq!(parse("im%d.png"), Some(("im", ".png")));
        assert_eq!(parse("100%.png"), None);
        assert_eq!(parse("im%s.d"), None);
        assert_eq!(parse("%05d/im.png"), None);
    }

    mod properties {
        use proptest::prelude::*;

        use super::*;

        proptest! {
            #[test]
            fn the_natural_order_is_a_total_order(a in "[a-b0-2]{0,5}", b in "[a-b0-2]{0,5}", c in "[a-b0-2]{0,5}") {
                prop_assert_eq!(natural_order(&a, &b), natural_order(&b, &a).reverse());
                if natural_order(&a, &b).is_le() && natural_order(&b, &c).is_le() {
                    prop_assert!(natural_order(&a, &c).is_le());
                }
            }
        }
    }
}
