//! Words and colours of the page.

/// Adds formatted text.
pub(crate) fn put(page: &mut String, text: std::fmt::Arguments<'_>) {
    page.push_str(&text.to_string());
}

/// Text as it may stand in HTML and in attributes. Characters that XML has not become a question mark.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\u{fffe}' | '\u{ffff}' => out.push('?'),
            it if it.is_control() => out.push('?'),
            it => out.push(it),
        }
    }
    out
}

/// Colour of a type, the same for all parts.
pub(crate) fn type_colour(mixture: usize) -> &'static str {
    const COLOURS: [&str; 8] = [
        "#4269d0", "#e08a1e", "#d1495b", "#2a9d8f", "#8e5bb5", "#7a8b2a", "#c2569b", "#6b4f3a",
    ];
    COLOURS[mixture % COLOURS.len()]
}

/// Colour of a part: the sides of the body differ.
pub(crate) fn part_colour(name: &str) -> &'static str {
    if name.starts_with("right") {
        "#d1495b"
    } else if name.starts_with("left") {
        "#4269d0"
    } else {
        "#2a9d8f"
    }
}
