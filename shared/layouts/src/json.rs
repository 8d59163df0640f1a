//! The layouts as JSON, for languages that build types as they run.

use messages::{Kept, Sides};
use serde_json::{Map, Value, json as value};
use skeleton::JointSet;

use crate::header::{limits, statuses};
use crate::table::{Field, Kind, Layout, layouts, topics};

/// Structs with sizes, offsets and types, topics with versions, statuses, limits, and the names of joints.
pub fn json() -> String {
    let structs: Map<String, Value> = layouts().iter().map(of_struct).collect();
    let topics: Map<String, Value> = topics()
        .into_iter()
        .map(|it| {
            let elements = it.elements.map(of_kind);
            let entry = value!({
                "name": it.name, "version": it.version, "message": it.message, "elements": elements,
            });
            (it.about, entry)
        })
        .collect();
    let statuses: Vec<&str> = statuses().map(messages::Status::reason).collect();
    let sides = [Sides::AS_SEEN, Sides::SURE, Sides::UNSURE].map(Sides::name);
    let kept = [Kept::SOLVED, Kept::START].map(Kept::name);
    let limits: Map<String, Value> = limits()
        .into_iter()
        .map(|(name, it)| (name.to_owned(), it.into()))
        .collect();
    let joint_sets: Map<String, Value> = JointSet::ALL.into_iter().map(of_joints).collect();
    let whole = value!({
        "joint_sets": joint_sets, "kept": kept, "limits": limits, "sides": sides, "statuses": statuses,
        "structs": structs, "topics": topics,
    });
    format!("{whole:#}\n")
}

fn of_joints(set: &JointSet) -> (String, Value) {
    let names: Vec<&str> = set.joints.iter().map(|it| it.name).collect();
    (set.name.to_owned(), names.into())
}

fn of_struct(layout: &Layout) -> (String, Value) {
    let fields: Vec<Value> = layout.fields.iter().map(of_field).collect();
    let entry = value!({
        "type_name": layout.type_name, "size": layout.size, "align": layout.align, "fields": fields,
    });
    (layout.name.to_owned(), entry)
}

fn of_field(field: &Field) -> Value {
    value!([field.name, of_kind(field.kind), field.lengths, field.offset])
}

/// A number as `NumPy` names it, a struct by its name.
fn of_kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Number { numpy, .. } => numpy,
        Kind::Struct(name) => name,
    }
}
