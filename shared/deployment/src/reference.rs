//! The reference of all settings, as Markdown.

use core::fmt::Write as _;

use toml::{Table, Value};

use crate::keys::{camera_keys, host_keys};
use crate::{ConfigError, Entry, Key, Loaded, keys};

const INTRODUCTION: &str = "\
# Settings

All keys of a deployment file, as `parallax config keys --markdown` prints them. A file needs `name`, `rig`, `output` and
a `[[camera]]` for each camera; everything else has a default. Relative paths are relative to the file. `--set section.key=value`
replaces a value for one run. `parallax config show FILE` prints all values and their origin, and `parallax config schema` prints a JSON
schema for editors. `[network]` has the keys of `method = \"network\"`, and `[paper]` has the keys of `method = \"paper\"`; a key of the
other method is an error.
";

/// Returns every key with its accepted values, its default and its meaning.
///
/// # Errors
///
/// Fails with [`ConfigError`] if the defaults cannot be read.
pub fn reference() -> Result<String, ConfigError> {
    let defaults = Loaded::defaults(&[])?;
    let entries = defaults.entries().unwrap_or_default();
    let mut text = INTRODUCTION.to_owned();
    let keys = keys();
    let (top, in_sections): (Vec<&Key>, Vec<&Key>) =
        keys.iter().partition(|key| !key.name.contains('.'));
    let default_of = |key: &Key| {
        let entry = entries.iter().find(|entry| entry.key == key.name);
        entry.and_then(default)
    };
    begin(&mut text, "At the top");
    for key in top {
        row(&mut text, &key.name, key, default_of(key));
    }
    for (list, keys) in [("camera", camera_keys()), ("host", host_keys())] {
        begin(&mut text, &format!("`[[{list}]]`"));
        for key in keys {
            row(&mut text, &key.name, &key, None);
        }
    }
    let mut last = "";
    for key in in_sections {
        let (section, name) = key.name.split_once('.').unwrap_or(("", &key.name));
        if section != last {
            begin(&mut text, &format!("`[{section}]`"));
            last = section;
        }
        row(&mut text, name, key, default_of(key));
    }
    Ok(text)
}

const HEAD: &str = "| key | takes | default | meaning |\n|---|---|---|---|\n";

fn begin(text: &mut String, title: &str) {
    // Writing to a string cannot fail.
    let _infallible = write!(text, "\n## {title}\n\n{HEAD}");
}

fn row(text: &mut String, name: &str, key: &Key, default: Option<String>) {
    let default = default.map_or(String::new(), |value| format!("`{value}`"));
    let [takes, meaning] = [&key.takes, &key.meaning].map(|cell| cell.replace('|', "\\|"));
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "| `{name}` | {takes} | {default} | {meaning} |");
}

/// Returns the default value of a key as text.
fn default(entry: &Entry) -> Option<String> {
    let required = Table::from_iter([
        ("name".to_owned(), Value::from("")),
        ("rig".to_owned(), Value::from("")),
        ("output".to_owned(), Value::from("")),
        ("camera".to_owned(), Value::Array(Vec::new())),
    ]);
    let value = entry.value.as_ref()?;
    let text = match *value {
        // A number in single precision is printed as it was written.
        Value::Float(it) if f64::from(it as f32) == it => (it as f32).to_string(),
        _ => value.to_string(),
    };
    (required.get(&entry.key) != Some(value)).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settings_reference_in_the_documentation_is_up_to_date() {
        let written = include_str!("../../../docs/settings.md");
        assert_eq!(
            written,
            reference().unwrap(),
            "write it anew: parallax config keys --markdown > docs/settings.md"
        );
    }
}
