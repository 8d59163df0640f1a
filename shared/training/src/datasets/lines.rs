//! The annotation file of Parallax: one JSON object per line, one person each.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::datasets::{Fault, Person};

/// The content of a line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    image: PathBuf,
    joints: Vec<Option<[f64; 2]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    visible: Option<Vec<bool>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
}

/// Parses one line into a person and an optional name. The person has `image` as written and an empty `row`.
///
/// Unknown joints become NaN and are not visible.
///
/// # Errors
///
/// Fails with [`Fault::Syntax`], or with [`Fault::Count`] if `visible` and `joints` differ in length.
pub fn parse_line(line: &str) -> Result<(Person, Option<String>), Fault> {
    let line: Line = serde_json::from_str(line).map_err(|error| Fault::Syntax {
        message: error.to_string(),
    })?;
    let n_joints = line.joints.len();
    let visible = line.visible.unwrap_or_else(|| vec![true; n_joints]);
    if visible.len() != n_joints {
        return Err(Fault::Count {
            what: "marks of visibility",
            got: visible.len(),
            expected: n_joints,
        });
    }
    let person = Person {
        image: line.image,
        row: String::new(),
        visible: visible
            .iter()
            .zip(&line.joints)
            .map(|(visible, joint)| *visible && joint.is_some())
            .collect(),
        joints: line.joints.into_iter().map(|joint| joint.unwrap_or([f64::NAN; 2])).collect(),
    };
    Ok((person, line.name))
}

/// Formats a person as a line, without a line break.
///
/// Joints that are not finite are written as unknown. [`parse_line`] returns the same person, with an empty `row`.
///
/// # Errors
///
/// Fails only if the path of the image is not Unicode.
pub fn to_line(person: &Person, name: Option<&str>) -> Result<String, serde_json::Error> {
    let known = |joint: &[f64; 2]| {
        let is_finite = joint.iter().all(|value| value.is_finite());
        is_finite.then_some(*joint)
    };
    serde_json::to_string(&Line {
        image: person.image.clone(),
        joints: person.joints.iter().map(known).collect(),
        visible: Some(person.visible.clone()),
        name: name.map(str::to_owned),
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_unknown_joint_is_written_as_nan_and_not_visible() {
        let (person, name) = parse_line(r#"{"image":"a/b.png","joints":[[1,2.5],null]}"#).unwrap();
        assert_eq!(person.joints[0], [1.0, 2.5]);
        assert!(person.joints[1][0].is_nan());
        assert_eq!(person.visible, [true, false]);
        assert_eq!((person.image, name), (PathBuf::from("a/b.png"), None));
    }

    #[test]
    fn errors_of_invalid_lines_name_the_cause() {
        let cases = [
            ("[]", "not a person: invalid length 0"),
            (
                r#"{"image":"a","joints":[],"jonits":1}"#,
                "not a person: unknown field `jonits`",
            ),
            (r#"{"joints":[]}"#, "not a person: missing field `image`"),
            (
                r#"{"image":"a","joints":[[1]]}"#,
                "not a person: invalid length 1",
            ),
            (
                r#"{"image":"a","joints":[[1e999,0]]}"#,
                "not a person: number out of range",
            ),
            (
                r#"{"image":"a","joints":[[1,2]],"visible":[]}"#,
                "0 marks of visibility, expected 1",
            ),
        ];
        for (line, expected) in cases {
            let error = parse_line(line).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{line}: {error}");
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(line: String) {
            drop(parse_line(&line));
        }

        #[test]
        fn a_written_line_is_read_back(
            image in "[a-z/\"\\\\ é]{1,12}",
            joints in prop::collection::vec((-1e6..1e6, -1e6..1e6, any::<bool>()), 0..20),
            name in prop::option::of("\\PC{0,8}"),
        ) {
            let person = Person {
                image: PathBuf::from(image),
                row: String::new(),
                joints: joints.iter().map(|joint| [joint.0, joint.1]).collect(),
                visible: joints.iter().map(|joint| joint.2).collect(),
            };
            let line = to_line(&person, name.as_deref()).unwrap();
            prop_assert!(!line.contains('\n'));
            prop_assert_eq!(parse_line(&line).unwrap(), (person, name));
        }
    }
}
