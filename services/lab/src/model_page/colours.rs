//! Colours of types and parts.

/// Colour of a type, the same for all parts.
pub(super) fn type_colour(mixture: usize) -> &'static str {
    const COLOURS: [&str; 8] = [
        "#4269d0", "#e08a1e", "#d1495b", "#2a9d8f", "#8e5bb5", "#7a8b2a", "#c2569b", "#6b4f3a",
    ];
    COLOURS[mixture % COLOURS.len()]
}

/// Colour of a part; the left and right side of the body have different colours.
pub(super) fn part_colour(name: &str) -> &'static str {
    if name.starts_with("right") {
        "#d1495b"
    } else if name.starts_with("left") {
        "#4269d0"
    } else {
        "#2a9d8f"
    }
}
