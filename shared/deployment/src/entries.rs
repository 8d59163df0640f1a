//! Every key of a deployment with its value and the origin of the value.

use toml::{Table, Value};

use crate::{Key, Loaded, keys};

/// Origin of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The value is the default.
    Default,
    /// The value is from the deployment file.
    File,
    /// The value is from `--set` or another option.
    CommandLine,
}

impl Origin {
    /// Returns the origin in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::File => "file",
            Self::CommandLine => "command line",
        }
    }
}

/// A key of a deployment with its value.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Entry {
    /// Name of the key, with its section.
    pub key: String,
    /// Value as TOML; `None` if the key is not set and has no default.
    pub value: Option<Value>,
    /// Origin of the value.
    pub origin: Origin,
    /// Meaning of the key.
    pub meaning: String,
}

impl Entry {
    /// Applies `change` to every text in the value.
    pub fn change_texts(&mut self, change: impl Fn(&str) -> String + Copy) {
        if let Some(value) = &mut self.value {
            change_texts(value, change);
        }
    }
}

fn change_texts(value: &mut Value, change: impl Fn(&str) -> String + Copy) {
    match value {
        Value::String(text) => *text = change(text),
        Value::Array(all) => all.iter_mut().for_each(|entry| change_texts(entry, change)),
        Value::Table(table) => table.iter_mut().for_each(|entry| change_texts(entry.1, change)),
        _ => {}
    }
}

impl Loaded {
    /// Returns every key with its value, in order.
    ///
    /// # Errors
    ///
    /// Fails if TOML cannot represent a value, such as a whole number beyond the range of a signed 64-bit integer.
    pub fn entries(&self) -> Result<Vec<Entry>, toml::ser::Error> {
        let table = Table::try_from(&self.deployment)?;
        let entry = |key: Key| Entry {
            value: lookup(&table, &key.name).cloned(),
            origin: self.origin(&key.name),
            key: key.name,
            meaning: key.meaning,
        };
        Ok(keys().into_iter().map(entry).collect())
    }

    fn origin(&self, key: &str) -> Origin {
        if lookup(&self.on_command_line, key).is_some() {
            Origin::CommandLine
        } else if lookup(&self.in_file, key).is_some() {
            Origin::File
        } else {
            Origin::Default
        }
    }
}

fn lookup<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        Some((section, rest)) => lookup(table.get(section)?.as_table()?, rest),
        None => table.get(key),
    }
}
