//! The layouts of mmpose: the people of a picture, or of the frames of a video. Positions and scores are in separate lists.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::files::json::{Numbers, from_json};
use crate::files::names::NameSet;
use crate::files::people::{Film, Frame, people_of};
use crate::files::seen::{FileError, MAX_FRAMES, MAX_PEOPLE, at_most};

/// Expected layout, for errors.
const LAYOUT: &str = "mmpose's `[{\"keypoints\": [[x, y], ...], \"keypoint_scores\": [...]}]`, or `[{\"frame_id\", \"instances\": [...]}]`";

/// A person.
#[derive(Deserialize)]
struct Instance {
    keypoints: Vec<Numbers>,
    #[serde(default)]
    keypoint_scores: Numbers,
}

/// A frame of a video.
#[derive(Deserialize)]
struct VideoFrame {
    frame_id: u64,
    instances: Vec<Instance>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Frames {
    Video(Vec<VideoFrame>),
    Picture(Vec<Instance>),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum File {
    /// Output of mmpose's demonstration scripts.
    Described {
        #[serde(default)]
        meta_info: Meta,
        instance_info: Frames,
    },
    /// Output of mmpose's inferencer.
    Plain(Frames),
}

#[derive(Default, Deserialize)]
struct Meta {
    #[serde(default)]
    keypoint_id2name: BTreeMap<String, String>,
}

/// Returns true if a text contains one of the keys that occur in no other layout.
pub(super) fn is_mmpose(text: &[u8]) -> bool {
    let has = |key: &[u8]| text.windows(key.len()).any(|part| part == key);
    let head = &text[..text.len().min(1 << 16)];
    let is_other = [&b"\"people\""[..], b"\"annotations\""]
        .iter()
        .any(|key| head.windows(key.len()).any(|part| part == *key));
    !is_other && (has(b"\"keypoint_scores\"") || has(b"\"instances\""))
}

/// Reads the file of a picture.
pub(super) fn frame(text: &[u8], names: Option<&NameSet>) -> Result<Frame, FileError> {
    let (told, frames) = read(text)?;
    let names = names.or(told.as_ref());
    match frames {
        Frames::Picture(people) => of_frame(&people, names),
        Frames::Video(frames) => match &frames[..] {
            [] => of_frame(&[], names),
            [only] => of_frame(&only.instances, names),
            several => Err(FileError::Entry {
                entry: "the list".to_owned(),
                got: format!("of {} frames", several.len()),
                expected: "one frame in each file of a folder; if one file contains all frames, give the file instead of the \
                           folder".to_owned(),
            }),
        },
    }
}

/// Reads the file of a video. Frames are counted from the lowest `frame_id`.
pub(super) fn film(text: &[u8], names: Option<&NameSet>) -> Result<Film, FileError> {
    let (told, frames) = read(text)?;
    let mut names = names.cloned().or(told);
    let frames = match frames {
        Frames::Video(frames) => frames,
        Frames::Picture(instances) => vec![VideoFrame {
            frame_id: 0,
            instances,
        }],
    };
    let first = frames.iter().map(|frame| frame.frame_id).min().unwrap_or(0);
    let mut people = BTreeMap::new();
    for frame in &frames {
        let number = frame.frame_id - first;
        if number >= MAX_FRAMES {
            return Err(FileError::Entry {
                entry: "frame_id".to_owned(),
                got: frame.frame_id.to_string(),
                expected: format!("less than {MAX_FRAMES} frames after the first frame"),
            });
        }
        let read = of_frame(&frame.instances, names.as_ref())?;
        names = names.or(read.names);
        people.insert(number, read.people);
    }
    let names = names.ok_or_else(|| FileError::Entry {
        entry: "the list".to_owned(),
        got: "without any person with keypoints".to_owned(),
        expected: "at least one person with keypoints, or the names of the keypoints".to_owned(),
    })?;
    Ok(Film {
        names,
        n_frames: people.last_key_value().map_or(0, |last| last.0 + 1),
        frames: people,
    })
}

fn read(text: &[u8]) -> Result<(Option<NameSet>, Frames), FileError> {
    Ok(match from_json(text, LAYOUT)? {
        File::Plain(frames) => (None, frames),
        File::Described {
            meta_info,
            instance_info,
        } => (meta_info.names()?, instance_info),
    })
}

impl Meta {
    /// Returns the names in the file, or a known set if it has the same number of keypoints and the same names.
    fn names(&self) -> Result<Option<NameSet>, FileError> {
        let mut named: Vec<(usize, &String)> = Vec::new();
        for (number, name) in &self.keypoint_id2name {
            named.extend(number.parse().ok().map(|number: usize| (number, name)));
        }
        named.sort();
        if named.is_empty() {
            return Ok(None);
        }
        let names = NameSet::new(named.iter().map(|named| named.1));
        let names = names.map_err(|source| FileError::Names {
            entry: "meta_info.keypoint_id2name".to_owned(),
            source,
        })?;
        let known = NameSet::of_number(names.n());
        Ok(known.filter(|known| names.names().starts_with(known.names())).or(Some(names)))
    }
}

fn of_frame(instances: &[Instance], names: Option<&NameSet>) -> Result<Frame, FileError> {
    at_most(instances.len(), MAX_PEOPLE, "people in a frame")?;
    let mut lists: Vec<Numbers> = Vec::new();
    for (nth, person) in instances.iter().enumerate() {
        let mut list = Numbers::new();
        for (number, place) in person.keypoints.iter().enumerate() {
            let [x, y] = place[..] else {
                return Err(FileError::Length {
                    entry: format!("instances[{nth}].keypoints[{number}]"),
                    got: place.len(),
                    expected: "2 numbers, the column and the row in the picture".to_owned(),
                });
            };
            let score = match person.keypoint_scores[..] {
                [] => Some(1.0),
                _ => person.keypoint_scores.get(number).copied().flatten(),
            };
            list.extend([x, y, score]);
        }
        lists.push(list);
    }
    let lists: Vec<&[Option<f64>]> = lists.iter().map(Vec::as_slice).collect();
    people_of(&lists, names, |nth| format!("instances[{nth}].keypoints"))
}

#[cfg(test)]
mod tests {
    use crate::files::{coco, openpose};

    fn person(n: usize, score: &str) -> String {
        let at = vec!["[10.5, 20.0]"; n].join(",");
        let scores = vec![score; n].join(",");
        format!(
            "{{\"keypoints\":[{at}],\"keypoint_scores\":[{scores}],\"bbox\":[[1,2,3,4]],\"bbox_score\":0.9}}"
        )
    }

    #[test]
    fn mmpose_files_of_pictures_and_videos_are_read() {
        let picture = format!("[{},{}]", person(17, "0.5"), person(17, "NaN"));
        let frame = openpose::parse(picture.as_bytes(), None).unwrap();
        let first = frame.people[0].keypoints[0].unwrap();
        assert_eq!((first.at, first.score), ([10.5, 20.0], 0.5));
        assert_eq!(frame.people[1].outline(), None);
        let video = format!(
            "[{{\"frame_id\":1,\"instances\":[]}},{{\"frame_id\":3,\"instances\":[{}]}}]",
            person(133, "0.5")
        );
        for text in [
            video.clone(),
            format!("{{\"meta_info\":{{\"num_keypoints\":133}},\"instance_info\":{video}}}"),
        ] {
            let film = coco::parse(text.as_bytes(), None).unwrap();
            assert_eq!((film.n_frames, film.names.n()), (3, 23));
            assert_eq!(film.frames[&0].len(), 0);
            assert_eq!(film.frames[&2].len(), 1);
        }
    }

    #[test]
    fn names_in_the_file_are_used() {
        let named = "\"0\":\"left_hip\",\"1\":\"right_hip\",\"10\":\"nose\",\"2\":\"neck\"";
        let text = format!(
            "{{\"meta_info\":{{\"keypoint_id2name\":{{{named}}}}},\"instance_info\":[{{\"frame_id\":0,\"instances\":[{}]}}]}}",
            person(4, "1")
        );
        let film = coco::parse(text.as_bytes(), None).unwrap();
        assert_eq!(
            film.names.names(),
            ["left hip", "right hip", "neck", "nose"]
        );
    }

    #[test]
    fn keypoint_files_with_3d_joints_are_refused() {
        let text = format!("[{}]", person(17, "1").replace("20.0", "20.0, 1.0"));
        let refused = openpose::parse(text.as_bytes(), None).unwrap_err();
        assert!(refused.to_string().contains("has 3 numbers"), "{refused}");
    }
}
