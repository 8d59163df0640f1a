//! Writes the clocks of cameras into the text of a deployment file, and leaves everything else unchanged.

use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Clock of a camera, with the values of its keys in a deployment file.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockKeys {
    /// Name of the camera.
    pub name: String,
    /// Value of the key `offset_ms`.
    pub offset_ms: f64,
    /// Value of the key `drift_ppm`; if it is `None` and the file has the key, the key is set to 0.
    pub drift_ppm: Option<f64>,
}

/// Reason why the clocks cannot be written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ClocksError {
    /// The file is not valid TOML.
    #[error("the file is no longer valid TOML")]
    Syntax,
    /// The file has no camera with that name.
    #[error("the file has no [[camera]] named {name:?}")]
    NoCamera {
        /// Name of the missing camera.
        name: String,
    },
    /// The camera entries have a form that cannot be edited safely. The file was not changed.
    #[error("the [[camera]] entries are written in a form that cannot be edited safely")]
    Form,
}

/// A change: the range to replace, and its new text.
type Edit = (Range<usize>, String);

/// Returns the text of a deployment file with the given clocks of its cameras.
///
/// # Errors
///
/// Fails with [`ClocksError`].
pub fn with_clocks(text: &str, clocks: &[ClockKeys]) -> Result<String, ClocksError> {
    let document = DeTable::parse(text).map_err(|_odd| ClocksError::Syntax)?;
    let cameras = document.get_ref().iter().find(|entry| entry.0.get_ref() == "camera");
    let cameras = cameras.and_then(|camera| camera.1.get_ref().as_array());
    let mut edits: Vec<Edit> = Vec::new();
    for clock in clocks {
        let mut tables = cameras.into_iter().flatten();
        let table = tables.find_map(|camera| {
            let table = camera.get_ref().as_table()?;
            (text_of(table, "name")?.1 == clock.name).then_some(table)
        });
        let table = table.ok_or_else(|| ClocksError::NoCamera {
            name: clock.name.clone(),
        })?;
        edits.extend(edits_of(text, table, clock));
    }
    edits.sort_by_key(|edit| core::cmp::Reverse(edit.0.start));
    let mut changed = text.to_owned();
    for (range, by) in edits {
        changed.replace_range(range, &by);
    }
    if is_as_meant(text, &changed, clocks) {
        Ok(changed)
    } else {
        Err(ClocksError::Form)
    }
}

/// Returns the text value of a key and its position, if the value is text.
fn text_of<'a>(table: &'a DeTable<'_>, key: &str) -> Option<(Range<usize>, &'a str)> {
    let (_, value) = table.iter().find(|entry| entry.0.get_ref() == key)?;
    match value.get_ref() {
        DeValue::String(text) => Some((value.span(), text)),
        _ => None,
    }
}

fn edits_of(text: &str, table: &DeTable<'_>, clock: &ClockKeys) -> Vec<Edit> {
    let mut edits = Vec::new();
    let mut added = Vec::new();
    let drift = clock.drift_ppm;
    for (key, value) in [("offset_ms", Some(clock.offset_ms)), ("drift_ppm", drift)] {
        let known = table.iter().find(|entry| entry.0.get_ref() == key);
        let known = known.map(|entry| entry.1.span());
        match (known, value) {
            (Some(span), value) => edits.push((span, number(value.unwrap_or(0.0)))),
            (None, Some(value)) => added.push(format!("{key} = {}", number(value))),
            (None, None) => {}
        }
    }
    if let Some((name, _)) = text_of(table, "name").filter(|_| !added.is_empty()) {
        let rest = &text[name.end..];
        let line = rest.find('\n').map_or(rest, |end| &rest[..end]);
        let is_alone = line.trim().is_empty() || line.trim_start().starts_with('#');
        if is_alone {
            let end = name.end + line.len();
            let end_of_line = if line.ends_with('\r') { "\r\n" } else { "\n" };
            let end = if line.ends_with('\r') { end - 1 } else { end };
            let lines = added.iter().flat_map(|entry| [end_of_line, entry]);
            edits.push((end..end, lines.collect()));
        } else {
            let entries = added.iter().flat_map(|entry| [", ", entry]);
            edits.push((name.end..name.end, entries.collect()));
        }
    }
    edits
}

/// Returns a number as TOML writes it, with a decimal point.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0');
    let text = if text.ends_with('.') {
        format!("{text}0")
    } else {
        text.to_owned()
    };
    if text == "-0.0" {
        "0.0".to_owned()
    } else {
        text
    }
}

/// Returns true if the changed text differs from the original in the clocks only.
fn is_as_meant(text: &str, changed: &str, clocks: &[ClockKeys]) -> bool {
    let read = |text: &str| text.parse::<Table>().ok();
    let (Some(mut before), Some(mut after)) = (read(text), read(changed)) else {
        return false;
    };
    for clock in clocks {
        let mut values = Vec::new();
        for table in [&mut before, &mut after] {
            let cameras = table.get_mut("camera").and_then(Value::as_array_mut);
            let mut cameras = cameras.into_iter().flatten();
            let camera = cameras
                .find(|camera| camera.get("name").and_then(Value::as_str) == Some(&clock.name));
            let Some(camera) = camera.and_then(Value::as_table_mut) else {
                return false;
            };
            let offset = camera.remove("offset_ms").and_then(|camera| camera.as_float());
            let drift = camera.remove("drift_ppm").and_then(|camera| camera.as_float());
            values.push((offset, drift.filter(|drift| *drift != 0.0)));
        }
        let as_written = |value: f64| number(value).parse::<f64>().ok();
        let wanted = clock.drift_ppm.and_then(as_written).filter(|ppm| *ppm != 0.0);
        if values[1] != (as_written(clock.offset_ms), wanted) {
            return false;
        }
    }
    before == after
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(name: &str, offset_ms: f64, drift_ppm: Option<f64>) -> ClockKeys {
        ClockKeys {
            name: name.to_owned(),
            offset_ms,
            drift_ppm,
        }
    }

    const TEXT: &str = "# mine\nname = 'd'\n\n[[camera]]   # left\nname = \"a\"  # the first\nsource = \"a.mp4\"\n\n\
                        [[camera]]\nsource = 'b.mp4'\nname = 'b'\noffset_ms = 7 # old\n";

    #[test]
    fn offsets_are_written_and_the_rest_of_the_file_is_unchanged() {
        let clocks = [clock("a", -12.34, Some(50.0)), clock("b", 0.0, None)];
        let changed = with_clocks(TEXT, &clocks).unwrap();
        let expected = TEXT
            .replace(
                "# the first\n",
                "# the first\noffset_ms = -12.34\ndrift_ppm = 50.0\n",
            )
            .replace("= 7 #", "= 0.0 #");
        assert_eq!(changed, expected);
        // Writing the same clocks again changes nothing.
        assert_eq!(with_clocks(&changed, &clocks).unwrap(), changed);
        let without = with_clocks(&changed, &[clock("a", 1.0, None)]).unwrap();
        assert!(
            without.contains("offset_ms = 1.0\ndrift_ppm = 0.0"),
            "{without}"
        );
    }

    #[test]
    fn cameras_may_be_written_in_one_line() {
        let text = "camera = [{ name = 'a', source = 'x' }, { source = 'y', name = 'b' }]\n";
        let changed = with_clocks(text, &[clock("b", 3.0, None)]).unwrap();
        assert_eq!(
            changed,
            text.replace("name = 'b'", "name = 'b', offset_ms = 3.0")
        );
    }

    #[test]
    fn windows_line_endings_are_kept() {
        let text = "[[camera]]\r\nname = 'a'\r\nsource = 'x'\r\n";
        let changed = with_clocks(text, &[clock("a", 3.0, None)]).unwrap();
        assert_eq!(
            changed,
            text.replace("'a'\r\n", "'a'\r\noffset_ms = 3.0\r\n")
        );
    }

    #[test]
    fn invalid_syntax_and_missing_cameras_are_refused() {
        let refused = |text: &str| with_clocks(text, &[clock("z", 3.0, None)]).unwrap_err();
        assert_eq!(refused("a = ["), ClocksError::Syntax);
        assert!(matches!(refused(TEXT), ClocksError::NoCamera { .. }));
        assert!(matches!(
            refused("camera = 3"),
            ClocksError::NoCamera { .. }
        ));
    }
}
