//! A person of a frame as one line of JSON.

use core::fmt::Write as _;

use serde_json::Value;

use crate::publish::MOST_BYTES;
use crate::publish::frame::{Frame, Place};

/// Returns one line of JSON about a person of a frame; `None` if it does not fit even without the names of the joints.
///
/// `joints` is an object by name. If this does not fit into [`MOST_BYTES`], it is an array in the order of [`json_names`]. A joint
/// with a position is `[x, y, z, deviation]` in metres. A joint without a position is the reason as text, never zeros.
pub fn json_datagram(frame: &Frame<'_>) -> Option<String> {
    let forms = [true, false].map(|with_names| line(frame, with_names));
    forms.into_iter().find(|form| form.len() <= MOST_BYTES)
}

/// Returns one line of JSON with the names of the joints in their order; `None` if it does not fit.
pub fn json_names(frame: &Frame<'_>) -> Option<String> {
    let names: Vec<&str> = frame.joints.iter().map(|joint| joint.0).collect();
    let names = Value::from(names);
    let deployment = Value::from(frame.deployment);
    let text = format!("{{\"parallax\":2,\"deployment\":{deployment},\"names\":{names}}}\n");
    (text.len() <= MOST_BYTES).then_some(text)
}

fn line(frame: &Frame<'_>, with_names: bool) -> String {
    let text_of = Value::from;
    let mut text = format!(
        "{{\"parallax\":2,\"deployment\":{},\"session\":{},\"frame\":{},\"captured_at_nanos\":{},\
         \"person\":{},\"people\":{},\"seen\":{},\"status\":{},\"sides\":{},\"missed\":{},\"joints\":",
        text_of(frame.deployment),
        frame.session,
        frame.frame,
        frame.captured_at_nanos,
        frame.person,
        frame.n_people,
        frame.n_seen,
        text_of(frame.status),
        text_of(frame.sides),
        frame.n_missed,
    );
    text.push(if with_names { '{' } else { '[' });
    for (nth, (name, found)) in frame.joints.iter().enumerate() {
        if nth > 0 {
            text.push(',');
        }
        if with_names {
            text.push_str(&text_of(name).to_string());
            text.push(':');
        }
        match found {
            Ok(place) => push_place(&mut text, place),
            Err(why) => text.push_str(&text_of(why).to_string()),
        }
    }
    text.push_str(if with_names { "}}\n" } else { "]}\n" });
    text
}

/// Writes a position in metres, to a tenth of a millimetre.
fn push_place(text: &mut String, place: &Place) {
    let [x, y, z] = place.in_world;
    // Writing into a string cannot fail.
    let _written = write!(text, "[{x:.4},{y:.4},{z:.4},{:.4}]", place.deviation_m);
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn frame<'a>(names: &[&'a str]) -> Frame<'a> {
        let place = Place {
            in_world: [-1234.56789, 0.5, 1.25],
            deviation_m: 0.0123,
        };
        let joint = |(nth, name): (usize, &&'a str)| {
            (
                *name,
                if nth % 3 == 2 {
                    Err("too few views")
                } else {
                    Ok(place)
                },
            )
        };
        Frame {
            deployment: "walk",
            session: u64::MAX,
            frame: 12,
            captured_at_nanos: 34,
            person: 3,
            n_people: 2,
            status: "ok",
            sides: "unsure",
            n_seen: 4,
            n_missed: 2,
            joints: names.iter().enumerate().map(joint).collect(),
        }
    }

    #[test]
    fn a_line_contains_joint_positions_and_reasons_for_missing_ones() {
        let text = json_datagram(&frame(&["head", "neck", "right \"wrist\""])).unwrap();
        assert!(text.ends_with("}}\n") && !text[..text.len() - 1].contains('\n'));
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            value["joints"]["head"],
            serde_json::json!([-1234.5679, 0.5, 1.25, 0.0123])
        );
        assert_eq!(value["joints"]["right \"wrist\""], "too few views");
        assert_eq!(
            (&value["frame"], &value["sides"]),
            (&12.into(), &"unsure".into())
        );
        assert_eq!(value["session"], u64::MAX);
        let counts = ["parallax", "person", "people", "seen"].map(|key| value[key].as_u64());
        assert_eq!(counts, [2, 3, 2, 4].map(Some));
    }

    #[test]
    fn names_that_do_not_fit_are_left_out_and_too_large_lines_are_not_sent() {
        let long: Vec<String> =
            (0..32).map(|i| format!("a joint with a very long name {i}")).collect();
        let names: Vec<&str> = long.iter().map(String::as_str).collect();
        let text = json_datagram(&frame(&names)).unwrap();
        assert!(text.len() <= MOST_BYTES);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["joints"].as_array().map(Vec::len), Some(32));
        assert_eq!(value["joints"][2], "too few views");
        assert!(json_names(&frame(&names)).is_some_and(|json_name| json_name.len() <= MOST_BYTES));
        let many: Vec<&str> = vec!["x"; 100];
        assert_eq!(json_datagram(&frame(&many)), None);
    }
}
