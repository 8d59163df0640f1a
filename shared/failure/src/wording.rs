//! Error texts for users.
//!
//! This module writes an error with its causes in one line, and replaces terms of the TOML and JSON parsers and of the transport with words
//! that users know. It also quotes words of shell commands and aligns tables.

mod causes;
mod table;

use core::fmt::Display;

pub use causes::{chain, in_one_line};
pub use table::Table;

/// Returns a word of a printed command, quoted if a shell would misread it.
///
/// ```
/// assert_eq!(failure::wording::shell("runs/one.toml"), "runs/one.toml");
/// assert_eq!(failure::wording::shell("room 1 #a/it's.toml"), r"'room 1 #a/it'\''s.toml'");
/// ```
#[must_use]
pub fn shell(word: impl Display) -> String {
    let word = word.to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_./:,=@%+".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word;
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Replaces serde's terms in an error text by terms that users know.
///
/// ```
/// let text = "line 3: invalid type: string \"x\", expected u64";
/// assert_eq!(
///     failure::wording::in_words(text),
///     "line 3: expected a whole number of at least 0, found the text \"x\""
/// );
/// ```
#[must_use]
pub fn in_words(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(line).collect();
    lines.join("\n")
}

fn line(text: &str) -> String {
    for kind in ["invalid type: ", "invalid value: ", "invalid length "] {
        if let Some((before, complaint)) = text.split_once(kind)
            && let Some((got, rest)) = complaint.rsplit_once(", expected ")
        {
            let end = [" at line ", " in `"].iter().filter_map(|mark| rest.find(mark)).min();
            let (asked, after) = rest.split_at(end.unwrap_or(rest.len()));
            let got = if kind.contains("length") {
                format!("{got} values")
            } else {
                found(got)
            };
            return format!("{before}expected {}, found {got}{after}", wanted(asked));
        }
    }
    if let Some(readable) = of_transport(text) {
        return readable;
    }
    if text.starts_with("string values must be quoted") {
        return "expected a value; text must be in quotes, as in key = \"text\"".to_owned();
    }
    [
        ("missing field", "missing key"),
        ("unknown field", "unknown key"),
        ("unknown variant", "unknown value"),
        ("duplicate field", "key given twice:"),
        ("stream did not contain valid UTF-8", "it is not UTF-8 text"),
        ("expected ident at line", "this is not JSON: wrong at line"),
    ]
    .iter()
    .fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// Rewrites texts such as `SendError::InternalError`, which is the whole error text of iceoryx2.
fn of_transport(text: &str) -> Option<String> {
    let (of, what) = text.split_once("Error::")?;
    let is_name = |name: &str| {
        name.starts_with(char::is_uppercase)
            && name.bytes().all(|byte| byte.is_ascii_alphanumeric())
    };
    if !is_name(of) || !is_name(what) {
        return None;
    }
    let words = split_words(what);
    Some(format!(
        "the transport iceoryx2 reports: {words} ({of}Error)"
    ))
}

/// Returns the name of a transport error that has no text, split into words.
#[must_use]
pub fn spaced(error: &impl std::fmt::Debug) -> String {
    split_words(&format!("{error:?}"))
}

/// Splits a name such as `InternalError` into words.
fn split_words(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(letter.to_ascii_lowercase());
    }
    words
}

/// Describes the value that was found.
fn found(got: &str) -> String {
    let plain = |value: &str| value.trim_matches('`').to_owned();
    if let Some(text) = got.strip_prefix("string ") {
        return format!("the text {text}");
    }
    for kind in ["integer ", "floating point ", "boolean "] {
        if let Some(value) = got.strip_prefix(kind) {
            let value = value.split(" as ").next().unwrap_or(value);
            return plain(value);
        }
    }
    match got {
        "map" => "a table of keys".to_owned(),
        "sequence" => "a list".to_owned(),
        "null" | "unit value" | "Option value" => "nothing".to_owned(),
        _ => got.to_owned(),
    }
}

/// Describes the expected value.
fn wanted(asked: &str) -> String {
    let number = asked
        .strip_prefix("an array of length ")
        .or_else(|| asked.strip_prefix("a tuple of size "));
    if let Some(n) = number {
        return format!("a list of {n} values, [..., ...]");
    }
    if asked.starts_with("struct ") || asked == "a map" {
        return "a table of keys".to_owned();
    }
    match asked {
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number of at least 0 and at most 4294967295",
        "u64" | "usize" | "u128" => "a whole number of at least 0",
        "i8" | "i16" | "i32" | "i64" | "isize" | "i128" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a string" | "path string" | "a borrowed string" => "text in quotes",
        "a sequence" => "a list, [...]",
        asked => asked,
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::in_words;

    fn check(text: &str, expect: &str) {
        assert_eq!(in_words(text), expect);
    }

    #[test]
    fn types_are_described_in_words_for_users() {
        check(
            "invalid value: integer `-1`, expected u64",
            "expected a whole number of at least 0, found -1",
        );
        check(
            "invalid type: integer `99999999999999999999` as i128, expected u32",
            "expected a whole number of at least 0 and at most 4294967295, found 99999999999999999999",
        );
        check(
            "invalid type: map, expected a sequence",
            "expected a list, [...], found a table of keys",
        );
        check(
            "a.json: invalid type: string \"a, b\", expected f64 at line 3 column 7",
            "a.json: expected a number, found the text \"a, b\" at line 3 column 7",
        );
        check(
            "invalid length 3, expected an array of length 2",
            "expected a list of 2 values, [..., ...], found 3 values",
        );
        check(
            "TOML parse error at line 7\n7 | size_px = 3\ninvalid type: integer `3`, expected an array of length 2\n",
            "TOML parse error at line 7\n7 | size_px = 3\nexpected a list of 2 values, [..., ...], found 3\n",
        );
    }

    #[test]
    fn other_texts_are_unchanged() {
        for text in ["", "no such footage: a.mp4", "expected 3, found 4\n\nx"] {
            check(text, text);
        }
    }

    #[test]
    fn errors_of_the_transport_are_attributed_to_it() {
        check(
            "SendError::InternalError",
            "the transport iceoryx2 reports: internal error (SendError)",
        );
        for text in ["Error: a::b", "a::b", "SendError::", "see std::io"] {
            check(text, text);
        }
    }
}
