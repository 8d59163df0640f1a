//! Words as they may stand in HTML, and data as it may stand in a script.

use serde_json::Value;

/// Adds formatted text.
pub(crate) fn put(page: &mut String, text: std::fmt::Arguments<'_>) {
    page.push_str(&std::fmt::format(text));
}

/// Text that means itself in HTML and in attributes.
pub(crate) fn escaped(text: &str) -> String {
    let escape = |it: char| match it {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        '\'' => "&#39;".to_owned(),
        it => it.to_string(),
    };
    text.chars().map(escape).collect()
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
}
