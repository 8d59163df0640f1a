//! Top level of an `OpenCV` storage: names and their values.

use std::collections::BTreeMap;

use super::ParseError;

mod xml;
mod yaml;

/// Value stored under one name.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Entry {
    Nothing,
    Number(f64),
    Text(String),
    List(Vec<Self>),
    /// A matrix, with rows, cols and data.
    Map(BTreeMap<String, Self>),
}

impl Entry {
    /// Returns the numbers of a matrix or a list, row by row.
    pub(super) fn numbers(&self, key: &str) -> Result<Vec<f64>, ParseError> {
        let mut numbers = Vec::new();
        match self {
            Self::List(list) => flatten(key, list, &mut numbers)?,
            Self::Map(map) => {
                let field = |name: &str| {
                    let key = format!("{key}.{name}");
                    map.get(name).ok_or(ParseError::Missing { field: key })
                };
                let (rows, columns) = (field("rows")?.number(key)?, field("cols")?.number(key)?);
                match field("data")? {
                    Self::List(data) => flatten(key, data, &mut numbers)?,
                    other => return Err(other.is_not(key, "a list of numbers")),
                }
                if rows * columns != numbers.len() as f64 {
                    return Err(ParseError::Shape {
                        field: key.to_owned(),
                        expected: "one number for each entry of the matrix",
                        found: format!(
                            "{} numbers for {rows} rows and {columns} columns",
                            numbers.len()
                        ),
                    });
                }
            }
            other => return Err(other.is_not(key, "a matrix or a list of numbers")),
        }
        Ok(numbers)
    }

    /// Returns a single number.
    pub(super) fn number(&self, key: &str) -> Result<f64, ParseError> {
        match self {
            Self::Number(number) => Ok(*number),
            other => Err(other.is_not(key, "a number")),
        }
    }

    fn is_not(&self, key: &str, expected: &'static str) -> ParseError {
        let found = match self {
            Self::Nothing => "nothing".to_owned(),
            Self::Number(number) => format!("the number {number}"),
            Self::Text(text) => format!("{text:?}"),
            Self::List(_) => "a list".to_owned(),
            Self::Map(_) => "a table".to_owned(),
        };
        ParseError::Shape {
            field: key.to_owned(),
            expected,
            found,
        }
    }
}

/// Appends the numbers of a list, including nested lists such as the rows of a matrix.
fn flatten(key: &str, list: &[Entry], into: &mut Vec<f64>) -> Result<(), ParseError> {
    for entry in list {
        match entry {
            Entry::List(inner) => flatten(key, inner, into)?,
            other => into.push(other.number(key)?),
        }
    }
    Ok(())
}

/// Entries of a storage by name.
#[derive(Debug, Default)]
pub(super) struct Storage(BTreeMap<String, Entry>);

impl Storage {
    /// Reads YAML, JSON or XML.
    pub(super) fn parse(text: &str) -> Result<Self, ParseError> {
        let text = text.trim_start_matches('\u{feff}');
        if text.trim_start().starts_with('<') {
            return xml::parse(text).map(Self);
        }
        yaml::parse(text).map(Self).map_err(|error| ParseError::Syntax {
            format: "YAML",
            source: Box::new(error),
        })
    }

    /// Adds the entries of another storage; existing entries are kept.
    pub(super) fn extend(&mut self, other: Self) {
        for (key, entry) in other.0 {
            self.0.entry(key).or_insert(entry);
        }
    }

    /// Returns the list of cameras, if present.
    pub(super) fn names(&self) -> Option<&Entry> {
        self.0.get("names")
    }

    /// Returns true if an entry has the name of a camera as its suffix.
    pub(super) fn has_suffixed(&self) -> bool {
        self.0.keys().any(|key| key.starts_with("K_") || key.starts_with("Rot_"))
    }

    /// Returns the names of the cameras: the list, or the suffixes of keys that begin with `K_`.
    pub(super) fn camera_names(&self) -> Result<Vec<String>, ParseError> {
        let keys = self.0.keys().filter_map(|key| key.strip_prefix("K_")).map(str::to_owned);
        match self.names() {
            None => Ok(keys.collect()),
            Some(Entry::List(names)) => names.iter().map(name).collect(),
            Some(other) => Err(other.is_not("names", "a list of quoted names")),
        }
    }

    /// Returns the first entry whose name is one of `keys`.
    pub(super) fn find<'k>(&self, keys: &'k [String]) -> Option<(&'k str, &Entry)> {
        keys.iter().find_map(|key| Some((key.as_str(), self.0.get(key)?)))
    }

    /// Returns the numbers under one of `keys`.
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

    /// Returns the text under `key`, if present.
    pub(super) fn text(&self, key: &str) -> Option<&str> {
        match self.0.get(key)? {
            Entry::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the number under `key`, if present.
    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, ParseError> {
        self.0.get(key).map(|entry| entry.number(key)).transpose()
    }
}

/// Returns a name of the list. Numbers are refused, because they would have lost their leading zeros.
fn name(entry: &Entry) -> Result<String, ParseError> {
    match entry {
        Entry::Text(name) => Ok(name.clone()),
        other => Err(other.is_not("names", "quoted names")),
    }
}
