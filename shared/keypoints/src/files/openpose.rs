//! The layout of OpenPose, which others write, too: a file for every frame.

use serde::Deserialize;

use crate::files::names::NameSet;
use crate::files::seen::{FileError, MAX_PEOPLE, SeenKeypoints, at_most, person, told_by};

/// What is expected, for errors.
const LAYOUT: &str = "`{\"people\": [{\"pose_keypoints_2d\": [x, y, confidence, ...]}]}`";

#[derive(Deserialize)]
struct File {
    people: Vec<Person>,
}

/// Its identity, and the keypoints of face and hands, are not read.
#[derive(Deserialize)]
struct Person {
    /// Left out, or empty, where a program keeps the place of a person whom it did not find.
    #[serde(default)]
    pose_keypoints_2d: Vec<f64>,
}

/// The people of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// What their keypoints are called; `None` where nobody has keypoints and no names were given.
    pub names: Option<NameSet>,
    /// In the order of the file. Without names their lists are empty.
    pub people: Vec<SeenKeypoints>,
}

/// Reads the file of a frame. A keypoint whose three numbers are 0 was not found.
///
/// * `names`: what the keypoints are called; `None`: what their number tells ([`NameSet::of_number`]).
///
/// # Errors
///
/// [`FileError`], naming the entry.
pub fn parse(text: &[u8], names: Option<&NameSet>) -> Result<Frame, FileError> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let file: File = serde_json::from_slice(text).map_err(|source| FileError::Json {
        layout: LAYOUT,
        source,
    })?;
    at_most(file.people.len(), MAX_PEOPLE, "people in a frame")?;
    let entry = |nth: usize| format!("people[{nth}].pose_keypoints_2d");
    let lists = file.people.iter().map(|it| &it.pose_keypoints_2d);
    let told = lists.enumerate().find(|it| !it.1.is_empty());
    let names = match (names, told) {
        (Some(names), _) => Some(names.clone()),
        (None, Some((nth, values))) => Some(told_by(values.len(), || entry(nth))?),
        (None, None) => None,
    };
    let read = |(nth, it): (usize, &Person)| match &names {
        Some(names) => person(
            &it.pose_keypoints_2d,
            names,
            || entry(nth),
            |it| it != [0.0; 3],
        ),
        None => Ok(SeenKeypoints::default()),
    };
    let people: Result<_, _> = file.people.iter().enumerate().map(read).collect();
    Ok(Frame {
        people: people?,
        names,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::decode::Keypoint;

    fn file(lists: &[&[f64]]) -> String {
        let people = lists.iter().map(|it| {
            format!("{{\"person_id\":[-1],\"pose_keypoints_2d\":{it:?},\"face_keypoints_2d\":[1]}}")
        });
        let people: Vec<String> = people.collect();
        format!("{{\"version\":1.3,\"people\":[{}]}}", people.join(","))
    }

    fn refused(text: &str) -> String {
        parse(text.as_bytes(), None).unwrap_err().to_string()
    }

    #[test]
    fn the_number_of_keypoints_names_them_and_zeros_are_not_found() {
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
    fn names_of_the_caller_go_before_the_number() {
        let names = NameSet::new(
            (0..24)
                .map(|it| format!("k{it}"))
                .chain(["neck".to_owned()]),
        );
        let names = names.unwrap();
        let frame = parse(file(&[&[1.0; 75]]).as_bytes(), Some(&names)).unwrap();
        assert_eq!(frame.names, Some(names));
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_place() {
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
    fn what_is_no_json_of_the_layout_is_refused_with_line_and_column() {
        for text in [
            "",
            "[]",
            "{}",
            "{\"people\":[{\"pose_keypoints_2d\":[NaN]}]}",
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

    proptest! {
        #[test]
        fn whatever_is_written_is_read_again(values in prop::collection::vec(-1e6..1e6, 51..52), n in 1_usize..4) {
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
