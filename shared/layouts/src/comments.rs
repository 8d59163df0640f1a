//! The comments of messages and their fields, from the source of the crate `messages`.

/// Where the structs are documented.
const SOURCES: [&str; 8] = [
    include_str!("../../messages/src/evidence.rs"),
    include_str!("../../messages/src/frame.rs"),
    include_str!("../../messages/src/health.rs"),
    include_str!("../../messages/src/metrics.rs"),
    include_str!("../../messages/src/picture.rs"),
    include_str!("../../messages/src/pose.rs"),
    include_str!("../../messages/src/pose3d.rs"),
    include_str!("../../messages/src/quality.rs"),
];
const STAMP: &str = include_str!("../../messages/src/stamp.rs");

/// The comment of a struct, one paragraph; empty if there is none.
pub(crate) fn of_struct(name: &str) -> String {
    let head = format!("pub struct {name} ");
    body(name).map_or_else(String::new, |(source, _)| comment_before(source, &head))
}

/// The comment of a field, one paragraph; empty if there is none.
pub(crate) fn of_field(name: &str, field: &str) -> String {
    let head = format!("    pub {field}: ");
    body(name).map_or_else(String::new, |(_, body)| comment_before(body, &head))
}

/// The source that has a struct, and the text of the struct.
fn body(name: &str) -> Option<(&'static str, &'static str)> {
    let head = format!("pub struct {name} {{\n");
    let mut sources = SOURCES.iter().copied().chain([STAMP]);
    sources.find_map(|source| {
        let begin = source.find(&head)? + head.len();
        let end = source[begin..].find("\n}")? + begin + 1;
        Some((source, &source[begin..end]))
    })
}

/// The lines of `///` right before the line that begins with `head`; lines of attributes between are passed over.
fn comment_before(text: &str, head: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let Some(at) = lines.iter().position(|it| it.starts_with(head)) else {
        return String::new();
    };
    let before = lines[..at].iter().rev().map(|it| it.trim());
    let comment = before
        .skip_while(|it| it.starts_with("#[") || it.starts_with(")]"))
        .map_while(|it| it.strip_prefix("///"));
    let mut comment: Vec<&str> = comment.map(str::trim).collect();
    comment.reverse();
    plain(&comment.join(" "))
}

/// Without the marks of links: ``[`Status::OK`](crate::Status)`` is `Status::OK`.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(['[', '`']) {
        plain.push_str(&rest[..at]);
        let is_link = rest[at..].starts_with("[`");
        let tail = &rest[at + 1..];
        if !is_link && rest[at..].starts_with('[') {
            plain.push('[');
            rest = tail;
            continue;
        }
        let inner = tail.strip_prefix('`').unwrap_or(tail);
        let Some(end) = inner.find('`') else {
            plain.push_str(inner);
            rest = "";
            break;
        };
        plain.push_str(&inner[..end]);
        rest = &inner[end + 1..];
        if is_link {
            rest = rest.strip_prefix(']').unwrap_or(rest);
            if let Some(target) = rest.strip_prefix('(') {
                rest = target.split_once(')').map_or("", |it| it.1);
            }
        }
    }
    plain.push_str(rest);
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layouts;

    #[test]
    fn every_struct_and_every_field_has_a_comment() {
        for layout in layouts() {
            assert!(of_struct(layout.name).len() > 10, "{}", layout.name);
            for field in &layout.fields {
                let comment = of_field(layout.name, field.name);
                assert!(
                    comment.ends_with('.'),
                    "{}.{}: {comment:?}",
                    layout.name,
                    field.name
                );
                assert!(!comment.contains("*/"), "{comment}");
            }
        }
        let position = of_field("Joint3d", "in_world");
        assert_eq!(position, "Position in the world frame of the rig, metres.");
    }

    #[test]
    fn names_are_those_of_the_transport() {
        for layout in layouts() {
            let (source, _) = body(layout.name).unwrap();
            let at = source
                .find(&format!("pub struct {} ", layout.name))
                .unwrap();
            let before = source[..at].rfind("#[type_name(\"").unwrap();
            let name = source[before..at].split('"').nth(1);
            assert_eq!(name, Some(layout.type_name));
        }
    }

    #[test]
    fn links_and_code_are_plain_text() {
        let text = "See [`Status::OK`](crate::Status) or `x`, [`Kept`]: `[xx, xy]` and [a, b].";
        assert_eq!(
            plain(text),
            "See Status::OK or x, Kept: [xx, xy] and [a, b]."
        );
    }
}
