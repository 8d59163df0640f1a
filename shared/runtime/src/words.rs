//! What readers of TOML and JSON say of a value, in the words of people.

/// A text in which complaints of `serde` are replaced by what a user can act on.
///
/// ```
/// let said = "line 3: invalid type: string \"x\", expected u64";
/// assert_eq!(
///     runtime::in_words(said),
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
            let end = [" at line ", " in `"]
                .iter()
                .filter_map(|it| rest.find(it))
                .min();
            let (asked, after) = rest.split_at(end.unwrap_or(rest.len()));
            let got = if kind.contains("length") {
                format!("{got} values")
            } else {
                found(got)
            };
            return format!("{before}expected {}, found {got}{after}", wanted(asked));
        }
    }
    if let Some(said) = of_transport(text) {
        return said;
    }
    if text.starts_with("string values must be quoted") {
        return "expected a value; text must stand in quotes, as in key = \"text\"".to_owned();
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

/// `SendError::InternalError`, which is all that the transport says of what went wrong.
fn of_transport(text: &str) -> Option<String> {
    let (of, what) = text.split_once("Error::")?;
    let is_name = |it: &str| {
        it.starts_with(char::is_uppercase) && it.bytes().all(|it| it.is_ascii_alphanumeric())
    };
    if !is_name(of) || !is_name(what) {
        return None;
    }
    let words = apart(what);
    Some(format!(
        "iceoryx2, which carries the messages, says: {words} ({of}Error)"
    ))
}

/// What the transport says of an error that has no words of its own.
pub(crate) fn said(error: &impl std::fmt::Debug) -> String {
    apart(&format!("{error:?}"))
}

/// `InternalError` in words.
fn apart(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(letter.to_ascii_lowercase());
    }
    words
}

/// What a value is.
fn found(got: &str) -> String {
    let plain = |it: &str| it.trim_matches('`').to_owned();
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

/// What would do.
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

    fn check(said: &str, expect: &str) {
        assert_eq!(in_words(said), expect);
    }

    #[test]
    fn types_of_the_program_are_words_of_its_users() {
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
    fn what_serde_did_not_say_stays_as_it_is() {
        for text in ["", "no such footage: a.mp4", "expected 3, found 4\n\nx"] {
            check(text, text);
        }
    }

    #[test]
    fn what_the_transport_says_is_said_to_be_its_own() {
        check(
            "SendError::InternalError",
            "iceoryx2, which carries the messages, says: internal error (SendError)",
        );
        for text in ["Error: a::b", "a::b", "SendError::", "see std::io"] {
            check(text, text);
        }
    }
}
