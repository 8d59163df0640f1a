//! JSON as programs write it, including `NaN` and `Infinity`, which are not valid JSON.

use std::borrow::Cow;

use serde::de::DeserializeOwned;

use crate::files::seen::FileError;

/// Numbers of a file; `None` for a value that is not a number.
pub(super) type Numbers = Vec<Option<f64>>;

/// Reads JSON. `NaN`, `nan`, `Infinity` and `-Infinity` are read as `null`.
///
/// * `layout`: expected layout, for errors.
pub(super) fn from_json<T: DeserializeOwned>(
    text: &[u8],
    layout: &'static str,
) -> Result<T, FileError> {
    serde_json::from_slice(text)
        .or_else(|source| match without_nan(text) {
            Cow::Borrowed(_) => Err(source),
            Cow::Owned(text) => serde_json::from_slice(&text),
        })
        .map_err(|source| FileError::Json { layout, source })
}

/// Replaces `NaN` and infinities outside strings by `null`.
fn without_nan(text: &[u8]) -> Cow<'_, [u8]> {
    const WORDS: [&[u8]; 4] = [b"NaN", b"nan", b"-Infinity", b"Infinity"];
    let mut changed = Vec::new();
    let (mut copied, mut at, mut in_string) = (0, 0, false);
    while at < text.len() {
        let word = WORDS.iter().find(|word| !in_string && text[at..].starts_with(word));
        if let Some(word) = word {
            changed.extend_from_slice(&text[copied..at]);
            changed.extend_from_slice(b"null");
            at += word.len();
            copied = at;
            continue;
        }
        match text[at] {
            b'"' => in_string = !in_string,
            b'\\' if in_string => at += 1,
            _ => {}
        }
        at += 1;
    }
    if copied == 0 {
        return Cow::Borrowed(text);
    }
    changed.extend_from_slice(&text[copied..]);
    Cow::Owned(changed)
}
