//! What all pages have in common: the style sheet, escaped text, data in a script.

use core::fmt::Write as _;

use serde_json::Value;

/// How all pages look: light or dark as the reader has it, and no wider than a telephone.
pub const STYLE: &str = include_str!("style.css");

/// Adds formatted text.
pub(crate) fn put(page: &mut String, text: core::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _infallible = page.write_fmt(text);
}

/// Text as it may stand in HTML, in XML and in attributes of both. Characters that XML has not become a question mark.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(character),
            '\u{fffe}' | '\u{ffff}' => out.push('?'),
            control if control.is_control() => out.push('?'),
            plain => out.push(plain),
        }
    }
    out
}

/// JSON that cannot end the `<script>` that it stands in.
pub(crate) fn in_script(value: &Value) -> String {
    let plain = value.to_string();
    plain.replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    proptest! {
        #[test]
        fn no_text_leaves_its_place(text: String) {
            let value = json!({ "text": text });
            let script = in_script(&value);
            prop_assert!(!script.contains('<'));
            prop_assert_eq!(serde_json::from_str::<Value>(&script).unwrap(), value);
            prop_assert!(!escaped(&text).contains(['<', '>', '"', '\'']));
        }
    }
    #[test]
    fn text_means_itself() {
        assert_eq!(
            escaped("<a href=\"x\">&"),
            "&lt;a href=&quot;x&quot;&gt;&amp;"
        );
    }
}
