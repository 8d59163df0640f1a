//! A selection of people of a data set: ranges of rows, or names of images.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A selection of the people in a data set.
///
/// A selection is written as ranges of rows from 1 (`1-100,150`), or as the path of a list file. Each line of the file is a range, a row or
/// the file name of an image. Every entry must match a person. If entries without a person were accepted, a typing error in the list of a
/// test set would leave people of the test set in the training set.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    rows: Vec<RangeInclusive<usize>>,
    images: BTreeSet<String>,
}

/// Reason why a selection is invalid.
#[derive(Debug, thiserror::Error)]
pub enum SelectError {
    /// The text is neither ranges of rows nor the path of a list file.
    #[error("{text:?} is neither rows (1-100,150) nor a file with a list of rows or image names")]
    NotASelection {
        /// The text as written by the user.
        text: String,
        /// Error of the operating system when reading a file of that name.
        source: io::Error,
    },
    /// A range ends before it begins, or begins at 0.
    #[error("there are no rows {first}-{last}: rows are counted from 1")]
    BadRange {
        /// First row of the range.
        first: usize,
        /// Last row of the range.
        last: usize,
    },
    /// The list file is empty.
    #[error("the list {} is empty: it has no rows or images", path.display())]
    EmptyList {
        /// The file.
        path: PathBuf,
    },
    /// The named image shows no person of the data set.
    #[error("{name} of the selection is not an image of {}", data.display())]
    NoSuchImage {
        /// Name of the image.
        name: String,
        /// The data set.
        data: PathBuf,
    },
    /// No person is in the range of rows.
    #[error("the rows {first}-{last} of the selection are not in {}", data.display())]
    NoSuchRows {
        /// First row of the range.
        first: usize,
        /// Last row of the range.
        last: usize,
        /// The data set.
        data: PathBuf,
    },
}

impl Selection {
    /// Parses a command-line argument: ranges of rows, or else the path of a list file.
    ///
    /// # Errors
    ///
    /// Fails with [`NotASelection`](SelectError::NotASelection), [`BadRange`](SelectError::BadRange),
    /// [`EmptyList`](SelectError::EmptyList).
    pub fn from_argument(text: &str) -> Result<Self, SelectError> {
        if let Some(rows) = ranges(text) {
            return Ok(Self {
                rows: rows?,
                images: BTreeSet::new(),
            });
        }
        match fs::read_to_string(text) {
            Ok(list) => Self::from_list(Path::new(text), &list),
            Err(source) => Err(SelectError::NotASelection {
                text: text.to_owned(),
                source,
            }),
        }
    }

    /// Parses the text of a list file.
    ///
    /// * `path`: path of the file, for messages.
    ///
    /// # Errors
    ///
    /// Fails with [`BadRange`](SelectError::BadRange) or [`EmptyList`](SelectError::EmptyList).
    pub fn from_list(path: &Path, list: &str) -> Result<Self, SelectError> {
        let mut selection = Self::default();
        for line in list.lines().map(str::trim).filter(|line| !line.is_empty()) {
            match ranges(line) {
                Some(rows) => selection.rows.extend(rows?),
                None => {
                    selection.images.insert(line.to_owned());
                }
            }
        }
        if selection == Self::default() {
            return Err(SelectError::EmptyList {
                path: path.to_owned(),
            });
        }
        Ok(selection)
    }

    /// Returns true if a person is selected.
    ///
    /// * `row`: number of the person's row, from 1.
    pub fn contains(&self, row: usize, image: &Path) -> bool {
        let by_name = || {
            let name = image.file_name().unwrap_or_default().to_string_lossy();
            self.images.contains(name.as_ref())
        };
        self.rows.iter().any(|rows| rows.contains(&row)) || by_name()
    }

    /// Checks that every range and every image name of the selection matches a person.
    ///
    /// * `data`: the data set, for messages.
    /// * `people`: row and image of every person.
    pub(crate) fn check(
        &self,
        data: &Path,
        people: &BTreeMap<usize, PathBuf>,
    ) -> Result<(), SelectError> {
        for rows in &self.rows {
            if people.range(rows.clone()).next().is_none() {
                return Err(SelectError::NoSuchRows {
                    first: *rows.start(),
                    last: *rows.end(),
                    data: data.to_owned(),
                });
            }
        }
        let names: BTreeSet<_> = people
            .values()
            .map(|image| image.file_name().unwrap_or_default().to_string_lossy())
            .collect();
        for name in &self.images {
            if !names.contains(name.as_str()) {
                return Err(SelectError::NoSuchImage {
                    name: name.clone(),
                    data: data.to_owned(),
                });
            }
        }
        Ok(())
    }
}

/// Parses ranges of rows separated by commas; `None` if the text is anything else.
fn ranges(text: &str) -> Option<Result<Vec<RangeInclusive<usize>>, SelectError>> {
    let number = |text: &str| text.trim().parse::<usize>().ok();
    let ranges: Option<Vec<_>> = text
        .split(',')
        .map(|range| match range.split_once('-') {
            Some((first, last)) => Some((number(first)?, number(last)?)),
            None => number(range).map(|row| (row, row)),
        })
        .collect();
    let checked = ranges?.into_iter().map(|(first, last)| {
        if first == 0 || last < first {
            Err(SelectError::BadRange { first, last })
        } else {
            Ok(first..=last)
        }
    });
    Some(checked.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows_of(selection: &Selection) -> Vec<usize> {
        let meant = |row: &usize| selection.contains(*row, Path::new("images/other.jpg"));
        (0..200).filter(meant).collect()
    }

    fn people() -> BTreeMap<usize, PathBuf> {
        BTreeMap::from([
            (1, PathBuf::from("images/a.jpg")),
            (3, PathBuf::from("images/b.jpg")),
        ])
    }

    #[test]
    fn ranges_include_both_ends() {
        let selection = Selection::from_argument("3-5, 9").unwrap();
        assert_eq!(rows_of(&selection), [3, 4, 5, 9]);
    }

    #[test]
    fn a_list_contains_row_numbers_and_image_file_names() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("list.txt");
        fs::write(&path, " im7.jpg\n\n2-3\n").unwrap();
        let selection = Selection::from_argument(path.to_str().unwrap()).unwrap();
        assert_eq!(rows_of(&selection), [2, 3]);
        assert!(selection.contains(99, Path::new("images/im7.jpg")));
        assert!(!selection.contains(99, Path::new("im7.jpg/im8.jpg")));
    }

    #[test]
    fn invalid_selections_are_refused() {
        let error = |text| Selection::from_argument(text).unwrap_err().to_string();
        assert!(error("5-4").starts_with("there are no rows 5-4"));
        assert!(error("0-4").starts_with("there are no rows 0-4"));
        assert!(error("no/such/list").starts_with("\"no/such/list\" is neither rows"));
        let empty = Selection::from_list(Path::new("l"), "\n \n").unwrap_err();
        assert_eq!(
            empty.to_string(),
            "the list l is empty: it has no rows or images"
        );
    }

    #[test]
    fn every_entry_must_match_a_person() {
        let check = |text: &str| {
            let selection = Selection::from_list(Path::new("l"), text).unwrap();
            selection.check(Path::new("set"), &people())
        };
        check("1-2\nb.jpg\n3-900").unwrap();
        assert!(matches!(
            check("2").unwrap_err(),
            SelectError::NoSuchRows {
                first: 2,
                last: 2,
                ..
            }
        ));
        let error = check("c.jpg").unwrap_err().to_string();
        assert_eq!(error, "c.jpg of the selection is not an image of set");
    }
}
