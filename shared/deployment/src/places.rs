//! Position of a key in a deployment file, and the key that an error of the TOML reader refers to.

use std::ops::Range;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::{ConfigError, slips};

/// Returns `file:line` of a span; the file alone if there is no span.
pub(super) fn place(file: &Path, text: &str, span: Option<Range<usize>>) -> String {
    let Some(before) = span.and_then(|span| text.get(..span.start)) else {
        return file.display().to_string();
    };
    let line = 1 + before.matches('\n').count();
    format!("{}:{line}", file.display())
}

/// Returns the position of a dotted key in `text`; the position of its section if the key itself is missing.
pub(super) fn span_of(text: &str, key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.into_inner();
    let mut found = None;
    for name in key.split('.') {
        let (name, value) = table.into_iter().find(|(known, _)| known.get_ref() == name)?;
        found = Some(name.span());
        match value.into_inner() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found
}

/// Returns the error for the text of a file, with its line and its key.
pub(super) fn malformed(file: &Path, text: &str, error: &toml::de::Error) -> ConfigError {
    let place = place(file, text, error.span());
    let at = error.span();
    let line = at.as_ref().and_then(|at| {
        let begin = text.get(..at.start)?.rfind('\n').map_or(0, |text| text + 1);
        text[begin..].lines().next()
    });
    if let Some(message) = slips::other_file(text).or_else(|| slips::of_line(line?)) {
        let message = message.to_owned();
        return ConfigError::Malformed { place, message };
    }
    let key = match &at {
        // In this case the document cannot be parsed, but the text at the span is the key itself.
        Some(span) if error.message().starts_with("duplicate key") => {
            text.get(span.clone()).map(str::to_owned)
        }
        Some(span) => key_at(text, span),
        None => None,
    };
    ConfigError::explain(place, error.message(), key.as_deref())
}

/// Returns the error for a `--set` option, with its key.
pub(super) fn of_set(error: &toml::de::Error) -> ConfigError {
    let said = error.to_string();
    let key = said.split("in `").nth(1).and_then(|part| part.split('`').next());
    ConfigError::explain("--set".to_owned(), error.message(), key)
}

/// Returns the dotted key whose value contains a span.
fn key_at(text: &str, span: &Range<usize>) -> Option<String> {
    within(DeTable::parse(text).ok()?.get_ref(), span)
}

/// Returns the dotted key in a table whose value contains a span. Inner values are searched first, because the span of a table covers
/// only its head.
fn within(table: &DeTable<'_>, span: &Range<usize>) -> Option<String> {
    table.iter().find_map(|(name, value)| {
        let inner = match value.get_ref() {
            DeValue::Table(it) => within(it, span),
            DeValue::Array(entries) => {
                entries.iter().find_map(|entry| within(entry.get_ref().as_table()?, span))
            }
            _ => None,
        };
        let name = name.get_ref();
        if let Some(inner) = inner {
            return Some(format!("{name}.{inner}"));
        }
        let holds = |range: Range<usize>| range.start <= span.start && span.end <= range.end;
        holds(value.span()).then(|| name.clone().into_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = 'a'\nsize = { w = 1 }\n[[camera]]\nname = 'x'\n[[camera]]\nname = 'y'\n\n\
                        [capture]\nscale = 5\nof = [1, 22]\n[paper.tau]\nfile = 3\n";

    #[test]
    fn errors_name_the_full_key_of_a_value() {
        for (value, key) in [
            ("'a'", "name"),
            ("1 }", "size.w"),
            ("'y'", "camera.name"),
            ("5", "capture.scale"),
            ("22", "capture.of"),
            ("3", "paper.tau.file"),
        ] {
            let start = TEXT.find(value).unwrap();
            assert_eq!(key_at(TEXT, &(start..start + 1)).as_deref(), Some(key));
        }
        assert_eq!(key_at("a = [", &(0..1)), None, "no document");
    }
}
