//! The reference of all settings, as Markdown.

use core::fmt::Write as _;

use toml::{Table, Value};

use crate::keys::{camera_keys, host_keys};
use crate::{ConfigError, Entry, Key, Loaded, keys};

const INTRODUCTION: &str = "\
# Settings

Every key of a deployment file, as `parallax config keys --markdown` prints it. A file needs `name`, `rig`, `output` and
a `[[camera]]` for each camera; everything else has a default. `--set section.key=value` replaces a value for one run,
`parallax config show FILE` prints all values and where each comes from, and `parallax config schema` prints a JSON schema
for editors. Relative paths are relative to the file.
";

/// Every key with what it takes, its default and its meaning.
///
/// # Errors
///
/// [`ConfigError`] if the defaults cannot be read.
pub fn reference() -> Result<String, ConfigError> {
    let defaults = Loaded::defaults(&[])?;
    let entries = defaults.entries().unwrap_or_default();
    let mut text = INTRODUCTION.to_owned();
    let mut section = None;
    for key in keys() {
        let (of, name) = key.name.split_once('.').unwrap_or(("", &key.name));
        if section != Some(of.to_owned()) {
            begin(&mut text, if of.is_empty() { None } else { Some(of) });
            section = Some(of.to_owned());
        }
        let entry = entries.iter().find(|it| it.key == key.name);
        row(&mut text, name, &key, entry.and_then(default));
        let list = match key.name.as_str() {
            "camera" => camera_keys(),
            "host" => host_keys(),
            _ => continue,
        };
        begin_list(&mut text, &key.name);
        for key in list {
            row(&mut text, &key.name, &key, None);
        }
    }
    Ok(text)
}

const HEAD: &str = "| key | takes | default | meaning |\n|---|---|---|---|\n";

fn begin(text: &mut String, section: Option<&str>) {
    let title = section.map_or("At the top".to_owned(), |it| format!("`[{it}]`"));
    // Writing to a string cannot fail.
    let _infallible = write!(text, "\n## {title}\n\n{HEAD}");
}

fn begin_list(text: &mut String, name: &str) {
    // Writing to a string cannot fail.
    let _infallible = write!(text, "\n## `[[{name}]]`\n\n{HEAD}");
}

fn row(text: &mut String, name: &str, key: &Key, default: Option<String>) {
    let default = default.map_or(String::new(), |it| format!("`{it}`"));
    let [takes, meaning] = [&key.takes, &key.meaning].map(|it| it.replace('|', "\\|"));
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "| `{name}` | {takes} | {default} | {meaning} |");
}

/// The value that a key has where nothing gives it one.
fn default(entry: &Entry) -> Option<String> {
    let required = Table::from_iter([
        ("name".to_owned(), Value::from("")),
        ("rig".to_owned(), Value::from("")),
        ("output".to_owned(), Value::from("")),
        ("camera".to_owned(), Value::Array(Vec::new())),
    ]);
    let value = entry.value.as_ref()?;
    let text = match *value {
        // Single precision, as it was written.
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
