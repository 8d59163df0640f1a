//! The layout of OpenPose, which other programs also write: a file for every frame.

use serde::Deserialize;

use crate::files::json::{Numbers, from_json};
use crate::files::mmpose;
use crate::files::names::NameSet;
pub use crate::files::people::Frame;
use crate::files::people::people_of;
use crate::files::seen::{FileError, MAX_PEOPLE, at_most};

/// Expected layout, for errors.
const LAYOUT: &str = "`{\"people\": [{\"pose_keypoints_2d\": [x, y, confidence, ...]}]}`";

/// A file of a frame; `bodies` and `joints` are keys of `AlphaPose`.
#[derive(Deserialize)]
struct File {
    #[serde(alias = "bodies")]
    people: Vec<Person>,
}

/// A person. The person's id, and the keypoints of face and hands, are not read.
#[derive(Deserialize)]
struct Person {
    /// Numbers of the keypoints. They are missing or empty if a program keeps the entry of a person that it did not find. Before version
    /// 1.4, `OpenPose` called this key `pose_keypoints`.
    #[serde(alias = "pose_keypoints", alias = "joints", alias = "keypoints")]
    pose_keypoints_2d: Option<Numbers>,
}

impl Person {
    fn numbers(&self) -> &[Option<f64>] {
        self.pose_keypoints_2d.as_deref().unwrap_or_default()
    }
}

/// Reads the file of a frame of `OpenPose` or of mmpose. A keypoint was not found if all its three numbers are 0, or if one of them is not
/// a number.
///
/// * `names`: names of the keypoints. If `None`, they are derived from the number of keypoints ([`NameSet::of_number`]).
///
/// # Errors
///
/// Returns a [`FileError`], which names the entry.
pub fn parse(text: &[u8], names: Option<&NameSet>) -> Result<Frame, FileError> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    if mmpose::is_mmpose(text) {
        return mmpose::frame(text, names);
    }
    if text.trim_ascii() == b"[]" {
        // This is a picture from mmpose in which no person was found.
        return people_of(&[], names, |_| String::new());
    }
    let file: File = from_json(text, LAYOUT)?;
    at_most(file.people.len(), MAX_PEOPLE, "people in a frame")?;
    if file.people.iter().any(|person| person.pose_keypoints_2d.is_none()) {
        other_keys(text)?;
    }
    let entry = |nth: usize| format!("people[{nth}].pose_keypoints_2d");
    let lists: Vec<&[Option<f64>]> = file.people.iter().map(Person::numbers).collect();
    people_of(&lists, names, entry)
}

/// Returns an error for a person whose keypoints are stored under keys that are not read.
fn other_keys(text: &[u8]) -> Result<(), FileError> {
    #[derive(Deserialize)]
    struct Whole {
        #[serde(alias = "bodies")]
        people: Vec<serde_json::Map<String, serde_json::Value>>,
    }
    const BODY: [&str; 4] = ["pose_keypoints_2d", "pose_keypoints", "joints", "keypoints"];
    let whole: Whole = from_json(text, LAYOUT)?;
    for (nth, person) in whole.people.iter().enumerate() {
        let has_body = BODY.iter().any(|key| person.contains_key(*key));
        let is_list =
            |value: &serde_json::Value| value.as_array().is_some_and(|array| array.len() > 2);
        let full = person.iter().filter(|(_, value)| is_list(value));
        let keys: Vec<String> = full.map(|(key, _)| key.chars().take(64).collect()).collect();
        if !has_body && !keys.is_empty() {
            return Err(FileError::OtherKeys {
                entry: format!("people[{nth}]"),
                keys,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::decode::Keypoint;

    fn file(lists: &[&[f64]]) -> String {
        let people = lists.iter().map(|list| {
            format!(
                "{{\"person_id\":[-1],\"pose_keypoints_2d\":{list:?},\"face_keypoints_2d\":[1]}}"
            )
        });
        let people: Vec<String> = people.collect();
        format!("{{\"version\":1.3,\"people\":[{}]}}", people.join(","))
    }

    fn refused(text: &str) -> String {
        parse(text.as_bytes(), None).unwrap_err().to_string()
    }

    #[test]
    fn the_number_of_keypoints_determines_their_names_and_zeros_mean_not_found() {
        let mut values = vec![0.0; 75];
        values[3..6].copy_from_slice(&[505.25, 431.5, 0.66]);
        values[6..9].copy_from_slice(&[-2.0, 3.0, 1.04]);
        let frame = parse(file(&[&values]).as_bytes(), None).unwrap();
        assert_eq!(frame.names, NameSet::of_number(25));
        let keypoints = &frame.people[0].keypoints;
        assert_eq!(keypoints.len(), 25);
        let at = |at, score| Some(Keypoint { at, score });
        assert_eq!(keypoints[0], None);
        assert_eq!(keypoints[1], at([505.25, 431.5], 0.66));
        assert_eq!(
            keypoints[2],
            at([-2.0, 3.0], 1.0),
            "a confidence is at most 1"
        );
        assert_eq!(frame.people[0].outline(), Some([-2.0, 3.0, 505.25, 431.5]));
    }

    #[test]
    fn a_frame_without_people_has_no_names_and_a_person_without_keypoints_keeps_its_place() {
        let frame = parse(file(&[]).as_bytes(), None).unwrap();
        assert_eq!((frame.names, frame.people), (None, vec![]));
        let text = format!(
            "\u{feff}{}",
            file(&[&[], &[1.0; 51]]).replace("[],", "[] ,")
        );
        let frame = parse(text.as_bytes(), None).unwrap();
        assert_eq!(frame.people[0].keypoints, vec![None; 17]);
        assert_eq!(frame.people[0].outline(), None);
        let given = NameSet::of_set("mpii-16").unwrap();
        let frame = parse(b"{\"people\":[{}]}", Some(&given)).unwrap();
        assert_eq!(frame.people[0].keypoints.len(), 16);
    }

    #[test]
    fn given_names_take_precedence_over_the_number_of_keypoints() {
        let names = NameSet::new((0..24).map(|i| format!("k{i}")).chain(["neck".to_owned()]));
        let names = names.unwrap();
        let frame = parse(file(&[&[1.0; 75]]).as_bytes(), Some(&names)).unwrap();
        assert_eq!(frame.names, Some(names));
    }

    #[test]
    fn impossible_openpose_values_are_refused_with_their_place() {
        let unknown = refused(&file(&[&[0.0; 9]]));
        assert!(
            unknown.contains("people[0]") && unknown.contains("3 keypoints"),
            "{unknown}"
        );
        let odd = refused(&file(&[&[0.0; 50]]));
        assert!(odd.contains("has 50 numbers"), "{odd}");
        let differs = refused(&file(&[&[0.0; 51], &[0.0; 75]]));
        assert!(
            differs.contains("people[1]") && differs.contains("75 numbers, expected 51"),
            "{differs}"
        );
        let mut far = [1.0; 51];
        far[4] = 1e9;
        let far = refused(&file(&[&far]));
        assert!(
            far.contains("number 4") && far.contains("1000000000"),
            "{far}"
        );
        let many = refused(&file(&vec![&[][..]; 10_000]));
        assert!(many.contains("10000 people"), "{many}");
    }

    #[test]
    fn invalid_json_is_refused_with_line_and_column() {
        for text in [
            "",
            "[1]",
            "{}",
            "{\"people\":[{\"pose_keypoints_2d\":[1e999]}]}",
            "{\"people\":[{\"pose_keypoints_2d\":\"x\"}]}",
        ] {
            let refused = refused(text);
            assert!(
                refused.contains("pose_keypoints_2d") && refused.contains("line 1"),
                "{text}: {refused}"
            );
        }
    }

    #[test]
    fn keypoints_under_the_keys_of_older_programs_are_read() {
        let text = file(&[&[1.0; 54]]);
        let plain = parse(text.as_bytes(), None).unwrap();
        assert_eq!(plain.people[0].keypoints.iter().flatten().count(), 18);
        let old = text.replace("pose_keypoints_2d", "pose_keypoints");
        assert_eq!(parse(old.as_bytes(), None).unwrap(), plain);
        let alpha = text.replace("people", "bodies");
        let alpha = alpha.replace("pose_keypoints_2d", "joints");
        assert_eq!(parse(alpha.as_bytes(), None).unwrap(), plain);
    }

    #[test]
    fn files_with_keypoints_only_under_unsupported_keys_are_refused_with_the_keys() {
        let text = file(&[&[1.0; 54]]).replace("pose_keypoints_2d", "pose_keypoints_3d");
        let other = refused(&text);
        assert!(
            other.contains("people[0]") && other.contains("`pose_keypoints_3d`"),
            "{other}"
        );
        let hands = "{\"people\":[{\"pose_keypoints_2d\":[],\"face_keypoints_2d\":[1,1,1]}]}";
        parse(hands.as_bytes(), None).unwrap();
    }

    #[test]
    fn a_keypoint_with_invalid_numbers_counts_as_not_found() {
        let text = file(&[&[1.0; 51]]);
        for nothing in ["NaN", "null", "Infinity", "-Infinity", "nan"] {
            let text = text.replacen("1.0", nothing, 1);
            let frame = parse(text.as_bytes(), None).unwrap();
            assert_eq!(frame.people[0].keypoints[0], None, "{nothing}");
            assert!(frame.people[0].keypoints[1].is_some(), "{nothing}");
        }
        let named = "{\"people\":[{\"who\":\"NaN, \\\"NaN\",\"pose_keypoints_2d\":[]}]}";
        parse(named.as_bytes(), None).unwrap();
    }

    #[test]
    fn from_133_keypoints_the_body_and_the_feet_are_read() {
        for (n, read, last) in [(133, 23, "right heel"), (136, 26, "right heel")] {
            let frame = parse(file(&[&vec![1.0; 3 * n]]).as_bytes(), None).unwrap();
            let names = frame.names.unwrap();
            assert_eq!(names.names().last().map(String::as_str), Some(last));
            assert_eq!(frame.people[0].keypoints.len(), read);
        }
    }

    proptest! {
        #[test]
        fn written_keypoints_are_read_back(values in prop::collection::vec(-1e6..1e6, 51..52), n in 1_usize..4) {
            let lists = vec![&values[..]; n];
            let frame = parse(file(&lists).as_bytes(), None).unwrap();
            prop_assert_eq!(frame.people.len(), n);
            for (it, values) in frame.people[n - 1].keypoints.iter().zip(values.chunks(3)) {
                let it = it.unwrap();
                prop_assert_eq!(it.at, [values[0], values[1]]);
                prop_assert!((0.0..=1.0).contains(&it.score));
            }
        }
    }
}
