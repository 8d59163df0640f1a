//! The message layouts as JSON, for languages that build types at run time.

use messages::{
    Kept, MAX_CANDIDATES, MAX_JOINTS, MAX_KEYPOINTS, MAX_LEVELS, MAX_NAME, MAX_PARTS, MAX_PEOPLE,
    MAX_ROWS, MAX_VIEW_KEYPOINTS, MAX_VIEWS, Sides, Status,
};
use serde_json::{Map, Value, json as value};
use skeleton::JointSet;

use super::table::{Field, Kind, Layout, layouts, topics};

/// Returns the JSON: structs with sizes, offsets and types; topics with versions; statuses, limits, and the names of joints.
pub(super) fn json() -> String {
    let structs: Map<String, Value> = layouts().iter().map(structure).collect();
    let topics: Map<String, Value> = topics()
        .into_iter()
        .map(|topic| {
            let elements = topic.elements.map(type_name);
            let described = value!({
                "name": topic.name, "version": topic.version, "message": topic.message, "elements": elements,
            });
            (topic.about, described)
        })
        .collect();
    let statuses: Vec<&str> = statuses().map(Status::reason).collect();
    let sides = [Sides::AS_SEEN, Sides::SURE, Sides::UNSURE].map(Sides::name);
    let kept = [Kept::SOLVED, Kept::START].map(Kept::name);
    let limits: Map<String, Value> = limits()
        .into_iter()
        .map(|(name, limit)| (name.to_owned(), limit.into()))
        .collect();
    let joint_sets: Map<String, Value> = JointSet::ALL.into_iter().map(joint_set).collect();
    let whole = value!({
        "joint_sets": joint_sets, "kept": kept, "limits": limits, "sides": sides, "statuses": statuses,
        "structs": structs, "topics": topics,
    });
    format!("{whole:#}\n")
}

fn joint_set(set: &JointSet) -> (String, Value) {
    let names: Vec<&str> = set.joints.iter().map(|joint| joint.name).collect();
    (set.name.to_owned(), names.into())
}

fn structure(layout: &Layout) -> (String, Value) {
    let fields: Vec<Value> = layout.fields.iter().map(entry).collect();
    let described = value!({
        "type_name": layout.type_name, "size": layout.size, "align": layout.align, "fields": fields,
    });
    (layout.name.to_owned(), described)
}

fn entry(field: &Field) -> Value {
    value!([
        field.name,
        type_name(field.kind),
        field.lengths,
        field.offset
    ])
}

/// Returns the `NumPy` name of a type of numbers, or the name of a struct.
fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Number(numpy) => numpy,
        Kind::Struct(name) => name,
    }
}

fn statuses() -> impl Iterator<Item = Status> {
    let all = (0..u32::MAX).map(Status);
    all.take_while(|status| status.reason() != "unknown")
}

fn limits() -> [(&'static str, usize); 11] {
    [
        ("MAX_PARTS", MAX_PARTS),
        ("MAX_VIEWS", MAX_VIEWS),
        ("MAX_CANDIDATES", MAX_CANDIDATES),
        ("MAX_PEOPLE", MAX_PEOPLE),
        ("MAX_JOINTS", MAX_JOINTS),
        ("MAX_KEYPOINTS", MAX_KEYPOINTS),
        ("MAX_VIEW_KEYPOINTS", MAX_VIEW_KEYPOINTS),
        ("MAX_LEVELS", MAX_LEVELS),
        ("MAX_ROWS", MAX_ROWS),
        ("MAX_NAME", MAX_NAME),
        ("CACHE_LINE", 64),
    ]
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    #[test]
    fn every_status_is_listed_with_a_unique_name() {
        let names: Vec<&str> = statuses().map(Status::reason).collect();
        assert_eq!(names.len(), 18);
        assert_eq!(names[1], "end of footage");
        let mut unique = names.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), names.len());
    }

    #[test]
    fn the_python_layouts_equal_the_message_layouts() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let text = fs::read_to_string(root.join("python/parallax_client/messages.json"));
        assert!(
            text.unwrap_or_default() == json(),
            "out of date: cargo run -- messages --json > python/parallax_client/messages.json"
        );
    }
}
