//! The top level of an `OpenCV` storage: names and what is stored under them.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::ParseError;

/// What is stored under one name.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub(super) enum Entry {
    /// `!!opencv-matrix`, or anything with the same fields.
    Matrix {
        rows: usize,
        cols: usize,
        data: Vec<f64>,
    },
    Number(f64),
    Numbers(Vec<f64>),
    Rows(Vec<Vec<f64>>),
    Texts(Vec<String>),
    Other(serde::de::IgnoredAny),
}

impl Entry {
    /// The numbers of a matrix or a list, row by row.
    pub(super) fn numbers(&self, key: &str) -> Result<Vec<f64>, ParseError> {
        let shape = |found: String| ParseError::Shape {
            field: key.to_owned(),
            expected: "a matrix or a list of numbers",
            found,
        };
        match self {
            Self::Matrix { rows, cols, data } if rows.checked_mul(*cols) == Some(data.len()) => {
                Ok(data.clone())
            }
            Self::Matrix { rows, cols, data } => Err(shape(format!(
                "{} numbers for {rows} rows of {cols}",
                data.len()
            ))),
            Self::Numbers(numbers) => Ok(numbers.clone()),
            Self::Rows(rows) => Ok(rows.concat()),
            Self::Number(number) => Err(shape(format!("the number {number}"))),
            Self::Texts(_) | Self::Other(_) => Err(shape("something else".to_owned())),
        }
    }

    /// A single number.
    pub(super) fn number(&self, key: &str) -> Result<f64, ParseError> {
        match self {
            Self::Number(number) => Ok(*number),
            other => Err(ParseError::Shape {
                field: key.to_owned(),
                expected: "a number",
                found: format!("{other:?}"),
            }),
        }
    }
}

/// A storage.
#[derive(Debug, Default)]
pub(super) struct Storage(BTreeMap<String, Entry>);

impl Storage {
    pub(super) fn parse(text: &str) -> Result<Self, ParseError> {
        let syntax = |error| ParseError::Syntax {
            format: "YAML",
            source: Box::new(error),
        };
        serde_saphyr::from_str(text).map(Self).map_err(syntax)
    }

    /// Takes over the entries of another storage; the earlier of two with one name stays.
    pub(super) fn extend(&mut self, other: Self) {
        for (key, entry) in other.0 {
            self.0.entry(key).or_insert(entry);
        }
    }

    /// The list of cameras, if it is there.
    pub(super) fn names(&self) -> Option<&Entry> {
        self.0.get("names")
    }

    /// Whether an entry is named as those of one camera among several.
    pub(super) fn has_suffixed(&self) -> bool {
        self.0
            .keys()
            .any(|key| key.starts_with("K_") || key.starts_with("Rot_"))
    }

    /// The names of the cameras: the list, or what follows `K_`.
    pub(super) fn camera_names(&self) -> Result<Vec<String>, ParseError> {
        match self.names() {
            None => Ok(self
                .0
                .keys()
                .filter_map(|key| key.strip_prefix("K_"))
                .map(str::to_owned)
                .collect()),
            Some(Entry::Texts(names)) => Ok(names.clone()),
            // An empty list.
            Some(Entry::Numbers(names)) if names.is_empty() => Ok(Vec::new()),
            Some(other) => Err(ParseError::Shape {
                field: "names".to_owned(),
                expected: "a list of quoted names",
                found: format!("{other:?}"),
            }),
        }
    }

    /// The first entry that has one of `keys` for its name.
    pub(super) fn find<'k>(&self, keys: &'k [String]) -> Option<(&'k str, &Entry)> {
        keys.iter()
            .find_map(|key| Some((key.as_str(), self.0.get(key)?)))
    }

    /// The numbers under one of `keys`.
    pub(super) fn numbers<'k>(
        &self,
        keys: &'k [String],
    ) -> Result<(&'k str, Vec<f64>), ParseError> {
        let found = self.find(keys);
        let (key, entry) = found.ok_or_else(|| ParseError::Missing {
            field: keys.join(" or "),
        })?;
        Ok((key, entry.numbers(key)?))
    }

    /// The number under `key`, if it is there.
    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, ParseError> {
        self.0.get(key).map(|entry| entry.number(key)).transpose()
    }
}
