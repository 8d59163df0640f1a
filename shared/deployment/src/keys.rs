//! Every key of a deployment file, what it means, its value and where that came from.

use toml::{Table, Value};

use crate::fields::fields_of;
use crate::schema::{Shapes, schema};
use crate::{
    Deployment, Loaded, Runtime, Supervision, capture, fuse, pose, quality, results, triangulate,
};

/// Who said a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Nobody.
    Default,
    /// The deployment file.
    File,
    /// `--set` or another option.
    CommandLine,
}

impl Origin {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::File => "file",
            Self::CommandLine => "command line",
        }
    }
}

/// One key.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Entry {
    /// With its section.
    pub key: String,
    /// As TOML; `None` if it is not set and has no default.
    pub value: Option<Value>,
    /// Who said it.
    pub origin: Origin,
    /// What it means.
    pub meaning: String,
}

/// A key of a deployment file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Its name with its section: `fuse.workers`.
    pub name: String,
    /// What it means: the documentation of its field.
    pub meaning: String,
    /// What it takes, as TOML: `whole number`, `"paper" or "released"`.
    pub takes: String,
}

/// A section, and its keys in order.
type Section = (&'static str, fn() -> &'static [&'static str]);

const SECTIONS: [Section; 8] = [
    ("capture", fields_of::<capture::Config>),
    ("pose", fields_of::<pose::Config>),
    ("quality", fields_of::<quality::Config>),
    ("fuse", fields_of::<fuse::Config>),
    ("triangulate", fields_of::<triangulate::Config>),
    ("results", fields_of::<results::Config>),
    ("supervise", fields_of::<Supervision>),
    ("runtime", fields_of::<Runtime>),
];

/// Older names of sections that are still read, with the names of today.
pub(crate) const OLDER: [(&str, &str); 1] = [("record", "results")];

/// Every key of a deployment file, in the order of the structs that read it. A `[[camera]]` is one key.
pub fn keys() -> Vec<Key> {
    let schema = Shapes(schema());
    let top = fields_of::<Deployment>().iter();
    let is_older = |name: &str| OLDER.iter().any(|it| it.0 == name);
    let mut keys = Vec::new();
    for name in top.filter(|it| !is_older(it)) {
        match SECTIONS.iter().find(|it| it.0 == *name) {
            Some((section, fields)) => keys.extend(
                fields()
                    .iter()
                    .map(|name| schema.key(&format!("{section}."), section, name)),
            ),
            None => keys.push(schema.key("", "", name)),
        }
    }
    keys
}

/// The keys of a `[[camera]]`, without their section.
pub(crate) fn camera_keys() -> Vec<Key> {
    let schema = Shapes(schema());
    let fields = fields_of::<capture::Camera>().iter();
    fields.map(|it| schema.key("", "camera", it)).collect()
}

impl Loaded {
    /// Every key with its value, in order.
    ///
    /// # Errors
    ///
    /// A value that TOML cannot hold, such as a whole number beyond 64 bits with sign.
    pub fn entries(&self) -> Result<Vec<Entry>, toml::ser::Error> {
        let table = Table::try_from(&self.deployment)?;
        let entry = |it: Key| Entry {
            value: lookup(&table, &it.name).cloned(),
            origin: self.origin(&it.name),
            key: it.name,
            meaning: it.meaning,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_that_has_a_value_is_listed_and_every_key_is_explained() {
        let keys = keys();
        let defaults = Loaded::defaults(&[]).unwrap().deployment;
        for (section, value) in &Table::try_from(defaults).unwrap() {
            let names: Vec<String> = match value {
                Value::Table(inner) => inner.keys().map(|it| format!("{section}.{it}")).collect(),
                _ => vec![section.clone()],
            };
            for name in names {
                assert!(
                    keys.iter().any(|it| it.name == name),
                    "{name} is not listed"
                );
            }
        }
        for it in keys.into_iter().chain(camera_keys()) {
            assert!(it.meaning.ends_with('.') && it.meaning.len() > 10, "{it:?}");
            assert!(!it.takes.is_empty() && !it.takes.contains("null"), "{it:?}");
        }
    }

    #[test]
    fn keys_are_in_the_order_of_their_sections() {
        let names: Vec<String> = keys().into_iter().map(|it| it.name).collect();
        assert_eq!(names[..3], ["name", "rig", "unit"]);
        assert_eq!(names.last().unwrap(), "runtime.lock_memory");
        let sections: Vec<&str> = names
            .iter()
            .filter_map(|it| Some(it.split_once('.')?.0))
            .collect();
        let mut unique = sections.clone();
        unique.dedup();
        assert_eq!(unique, SECTIONS.map(|it| it.0));
        assert!(
            !names.iter().any(|it| it.starts_with("record")),
            "{names:?}"
        );
    }
}
