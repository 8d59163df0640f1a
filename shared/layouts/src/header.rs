//! The layouts as a C header.

use core::fmt::Write as _;

use messages::{
    Kept, MAX_CANDIDATES, MAX_JOINTS, MAX_KEYPOINTS, MAX_LEVELS, MAX_NAME, MAX_PARTS, MAX_ROWS,
    MAX_VIEW_KEYPOINTS, MAX_VIEWS, Sides, Status,
};

use crate::comments;
use crate::table::{Field, Kind, Layout, layouts, topics};

/// Width of the lines of a comment.
const WIDTH: usize = 100;

/// The C header: structs with comments, names and versions of topics, statuses, limits; and assertions by which the compiler
/// checks every size and offset. C11, or C++11.
pub fn c_header() -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _written = write_all(&mut text);
    text
}

fn write_all(text: &mut String) -> core::fmt::Result {
    text.push_str(HEAD);
    writeln!(
        text,
        "/* Topics: \"{{}}\" is the view, worker or process. */"
    )?;
    for topic in topics() {
        let name = constant(&topic.about);
        writeln!(text, "#define PARALLAX_TOPIC_{name} \"{}\"", topic.name)?;
        writeln!(text, "#define PARALLAX_VERSION_{name} {}", topic.version)?;
    }
    writeln!(
        text,
        "\n/* Lengths of arrays: counts are never above them. */"
    )?;
    for (name, value) in limits() {
        writeln!(text, "#define PARALLAX_{name} {value}")?;
    }
    writeln!(
        text,
        "\n/* Whether a message carries a result, or why not: fields `status`. */"
    )?;
    for status in statuses() {
        let name = constant(status.reason());
        writeln!(text, "#define PARALLAX_STATUS_{name} {}", status.0)?;
    }
    writeln!(
        text,
        "\n/* Whether left and right are decided: Pose3d.sides. */"
    )?;
    for sides in [Sides::AS_SEEN, Sides::SURE, Sides::UNSURE] {
        writeln!(
            text,
            "#define PARALLAX_SIDES_{} {}",
            constant(sides.name()),
            sides.0
        )?;
    }
    writeln!(
        text,
        "\n/* Which poses the joints come from: Pose3d.kept. */"
    )?;
    for kept in [Kept::SOLVED, Kept::START] {
        writeln!(
            text,
            "#define PARALLAX_KEPT_{} {}",
            constant(kept.name()),
            kept.0
        )?;
    }
    for layout in layouts() {
        write_struct(text, &layout)?;
    }
    text.push_str(TAIL);
    Ok(())
}

fn write_struct(text: &mut String, layout: &Layout) -> core::fmt::Result {
    writeln!(text)?;
    comment(text, "", &comments::of_struct(layout.name))?;
    let align = if layout.align > 8 {
        format!("PARALLAX_ALIGNED({}) ", layout.align)
    } else {
        String::new()
    };
    writeln!(text, "typedef struct Parallax{} {{", layout.name)?;
    for (nth, field) in layout.fields.iter().enumerate() {
        comment(text, "    ", &comments::of_field(layout.name, field.name))?;
        let align = if nth == 0 { align.as_str() } else { "" };
        writeln!(text, "    {align}{};", declaration(field))?;
    }
    writeln!(text, "}} Parallax{};", layout.name)?;
    writeln!(
        text,
        "#define PARALLAX_TYPE_{} \"{}\"",
        layout.name, layout.type_name
    )?;
    let name = layout.name;
    writeln!(
        text,
        "PARALLAX_CHECK(sizeof(Parallax{name}) == {}, \"size of {name}\");",
        layout.size
    )?;
    for field in &layout.fields {
        let (field, offset) = (field.name, field.offset);
        writeln!(
            text,
            "PARALLAX_CHECK(offsetof(Parallax{name}, {field}) == {offset}, \"place of {name}.{field}\");"
        )?;
    }
    Ok(())
}

fn declaration(field: &Field) -> String {
    let kind = match field.kind {
        Kind::Number { c, .. } => c.to_owned(),
        Kind::Struct(name) => format!("Parallax{name}"),
    };
    let mut text = format!("{kind} {}", field.name);
    for length in &field.lengths {
        text.push('[');
        text.push_str(&length.to_string());
        text.push(']');
    }
    text
}

/// A comment in lines of at most [`WIDTH`] characters.
fn comment(text: &mut String, indent: &str, words: &str) -> core::fmt::Result {
    let mut line = format!("{indent}/*");
    for word in words.split(' ') {
        if line.len() + 1 + word.len() > WIDTH {
            writeln!(text, "{line}")?;
            line = format!("{indent}  ");
        }
        write!(line, " {word}")?;
    }
    writeln!(text, "{line} */")
}

/// `view-pose` as `VIEW_POSE`.
fn constant(name: &str) -> String {
    name.to_uppercase().replace(['-', ' '], "_")
}

pub(crate) fn statuses() -> impl Iterator<Item = Status> {
    let all = (0..u32::MAX).map(Status);
    all.take_while(|it| it.reason() != "unknown")
}

pub(crate) fn limits() -> [(&'static str, usize); 10] {
    [
        ("MAX_PARTS", MAX_PARTS),
        ("MAX_VIEWS", MAX_VIEWS),
        ("MAX_CANDIDATES", MAX_CANDIDATES),
        ("MAX_JOINTS", MAX_JOINTS),
        ("MAX_KEYPOINTS", MAX_KEYPOINTS),
        ("MAX_VIEW_KEYPOINTS", MAX_VIEW_KEYPOINTS),
        ("MAX_LEVELS", MAX_LEVELS),
        ("MAX_ROWS", MAX_ROWS),
        ("MAX_NAME", MAX_NAME),
        ("CACHE_LINE", 64),
    ]
}

const HEAD: &str = "\
/* Messages of Parallax, as they lie in shared memory and in files: little-endian, without padding.
 *
 * Made by `parallax messages --c`; do not edit. Counts come before arrays; entries beyond a count are
 * zero. Check every count, index and number before use: messages come from another process. On
 * topics of arrays the struct is the user header, and bytes or floats follow. */
#ifndef PARALLAX_MESSAGES_H
#define PARALLAX_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define PARALLAX_CHECK(holds, what) static_assert(holds, what)
#define PARALLAX_ALIGNED(bytes) alignas(bytes)
#else
#define PARALLAX_CHECK(holds, what) _Static_assert(holds, what)
#define PARALLAX_ALIGNED(bytes) _Alignas(bytes)
#endif

";

const TAIL: &str = "
#endif
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_are_all_there_and_have_different_names() {
        let names: Vec<String> = statuses().map(|it| constant(it.reason())).collect();
        assert_eq!(names.len(), 18);
        assert_eq!(names[1], "END_OF_FOOTAGE");
        let mut unique = names.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), names.len());
    }
}
