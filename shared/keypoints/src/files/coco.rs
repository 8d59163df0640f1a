//! The layout of COCO: one file for all frames, as a data set or as a list of results.

use core::fmt;
use std::collections::BTreeMap;

use serde::Deserialize;

use crate::files::json::{Numbers, from_json};
use crate::files::mmpose;
use crate::files::names::NameSet;
pub use crate::files::people::Film;
use crate::files::seen::{
    FileError, MAX_FRAMES, MAX_PEOPLE, SeenKeypoints, at_most, person, told_by,
};

/// Description of the layout of a data set, and of results, for errors.
const DATA_SET: &str =
    "`{\"images\": [{\"id\"}], \"annotations\": [{\"image_id\", \"keypoints\": [x, y, v, ...]}]}`";
const RESULTS: &str = "`[{\"image_id\", \"keypoints\": [x, y, confidence, ...]}]`";

#[derive(Deserialize)]
struct DataSet {
    images: Vec<Image>,
    annotations: Vec<Entry>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: ImageId,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    #[serde(default)]
    name: String,
    #[serde(default)]
    keypoints: Vec<String>,
}

/// A person of a data set or of results.
#[derive(Deserialize)]
struct Entry {
    image_id: ImageId,
    category_id: Option<u64>,
    #[serde(default)]
    keypoints: Numbers,
}

/// A number, or a text such as `000012`, `cam01_000012` or `000012.jpg`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(
    untagged,
    expecting = "expected an `image_id` that is a number or a text such as `000012.jpg`"
)]
enum ImageId {
    Number(u64),
    Text(String),
}

impl ImageId {
    /// Returns the number. If the value is a text, the number is formed by its last digits before the file extension.
    fn number(&self) -> Option<u64> {
        let text = match self {
            Self::Number(number) => return Some(*number),
            Self::Text(text) => text,
        };
        let is_extension =
            |text: &str| text.starts_with(|letter: char| letter.is_ascii_alphabetic());
        let stem = match text.rsplit_once('.') {
            Some((stem, extension)) if is_extension(extension) => stem,
            _ => text,
        };
        let rest = stem.trim_end_matches(|letter: char| letter.is_ascii_digit());
        stem[rest.len()..].parse().ok()
    }
}

impl fmt::Display for ImageId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "{:?}", text.chars().take(64).collect::<String>()),
        }
    }
}

/// Reads a file of COCO or of mmpose.
///
/// In a data set, frames are the images in the order of their `id`. In results, the `image_id` is the frame number. In a data set, the
/// third number of a keypoint is 0 if the keypoint is not labelled; otherwise, it is used as a score, limited to 1. In results, it is the
/// score. Annotations of categories other than people are ignored.
///
/// * `names`: names of the keypoints. If `None`, they are taken from the category or, failing that, derived from the number of keypoints
///   ([`NameSet::of_number`]).
///
/// # Errors
///
/// Returns a [`FileError`], which names the entry.
pub fn parse(text: &[u8], names: Option<&NameSet>) -> Result<Film, FileError> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    if mmpose::is_mmpose(text) {
        return mmpose::film(text, names);
    }
    if let Some(begin) = not_json(text) {
        return Err(FileError::NotJson { begin });
    }
    if text.trim_ascii_start().starts_with(b"[") {
        let entries: Vec<Entry> = from_json(text, RESULTS)?;
        return results(&entries, names);
    }
    let set: DataSet = from_json(text, DATA_SET)?;
    data_set(&set, names)
}

/// Returns the first letters of a text that is not JSON.
fn not_json(text: &[u8]) -> Option<String> {
    let text = text.trim_ascii_start();
    let is_json = text.first().is_some_and(|first| b"[{".contains(first));
    let begin = &text[..text.len().min(24)];
    (!is_json).then(|| String::from_utf8_lossy(begin).into_owned())
}

fn data_set(set: &DataSet, names: Option<&NameSet>) -> Result<Film, FileError> {
    at_most(set.images.len(), MAX_FRAMES as usize, "images")?;
    let mut ids = Vec::with_capacity(set.images.len());
    for (nth, image) in set.images.iter().enumerate() {
        ids.push(number(&image.id, || format!("images[{nth}].id"))?);
    }
    ids.sort_unstable();
    if let Some([twice, _]) = ids.array_windows().find(|[a, b]| a == b) {
        return Err(FileError::Entry {
            entry: "images[].id".to_owned(),
            got: format!("twice {twice}"),
            expected: "each image at most once".to_owned(),
        });
    }
    let category = category(&set.categories)?;
    let told = match (names, category) {
        (None, Some(it)) => {
            let named = NameSet::new(&it.keypoints);
            Some(named.map_err(|source| FileError::Names {
                entry: format!("the keypoints of category {}", it.id),
                source,
            })?)
        }
        (names, _) => names.cloned(),
    };
    let is_person = |entry: &Entry| match (entry.category_id, category) {
        (Some(own), Some(people)) => own == people.id,
        _ => true,
    };
    let frame_of = |id: u64| ids.binary_search(&id).ok().map(|value| value as u64);
    let mut film = collected(
        &set.annotations,
        "annotations",
        told.as_ref(),
        (is_person, frame_of),
    )?;
    film.n_frames = ids.len() as u64;
    for frame in 0..film.n_frames {
        film.frames.entry(frame).or_default();
    }
    Ok(film)
}

fn results(entries: &[Entry], names: Option<&NameSet>) -> Result<Film, FileError> {
    let frame_of = |id: u64| (id < MAX_FRAMES).then_some(id);
    let mut film = collected(entries, "", names, (|_: &Entry| true, frame_of))?;
    film.n_frames = film.frames.last_key_value().map_or(0, |last_key_value| last_key_value.0 + 1);
    Ok(film)
}

/// Returns the people of all entries.
///
/// * `list`: name of the list of entries, for errors.
/// * The last argument consists of two functions: one selects the entries to read, the other returns the frame of an image.
fn collected(
    entries: &[Entry],
    list: &str,
    names: Option<&NameSet>,
    (is_person, frame_of): (impl Fn(&Entry) -> bool, impl Fn(u64) -> Option<u64>),
) -> Result<Film, FileError> {
    let of_people = entries.iter().enumerate();
    let of_people = of_people.filter(|(_, it)| !it.keypoints.is_empty() && is_person(it));
    let mut names = names.cloned();
    let mut frames: BTreeMap<u64, Vec<SeenKeypoints>> = BTreeMap::new();
    for (nth, it) in of_people {
        let entry = || format!("{list}[{nth}].keypoints");
        let id = number(&it.image_id, || format!("{list}[{nth}].image_id"))?;
        let frame = frame_of(id).ok_or_else(|| FileError::Entry {
            entry: format!("{list}[{nth}].image_id"),
            got: it.image_id.to_string(),
            expected: if list.is_empty() {
                format!("a frame number below {MAX_FRAMES}")
            } else {
                "the `id` of one of `images`".to_owned()
            },
        })?;
        let names = match &mut names {
            Some(names) => names,
            names => names.insert(told_by(it.keypoints.len(), entry)?),
        };
        let is_data_set = !list.is_empty();
        let is_found = if is_data_set {
            |keypoint: [f64; 3]| keypoint[2] > 0.0
        } else {
            |keypoint: [f64; 3]| keypoint != [0.0; 3]
        };
        let people = frames.entry(frame).or_default();
        people.push(person(&it.keypoints, names, entry, is_found)?);
        at_most(people.len(), MAX_PEOPLE, "people in a frame")?;
    }
    let names = names.ok_or_else(|| FileError::Entry {
        entry: if list.is_empty() { "the list" } else { list }.to_owned(),
        got: "without any person with keypoints".to_owned(),
        expected: "at least one person with keypoints, or the names of the keypoints".to_owned(),
    })?;
    Ok(Film {
        names,
        n_frames: 0,
        frames,
    })
}

/// Returns the category of people: the only one that has keypoints, or the one called `person`.
fn category(all: &[Category]) -> Result<Option<&Category>, FileError> {
    let with: Vec<&Category> =
        all.iter().filter(|category| !category.keypoints.is_empty()).collect();
    match &with[..] {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        several => {
            let person = several.iter().find(|category| category.name == "person");
            let person = person.ok_or_else(|| FileError::Entry {
                entry: "categories".to_owned(),
                got: format!("{} with keypoints", several.len()),
                expected: "only one category with keypoints, or a category called \"person\""
                    .to_owned(),
            })?;
            Ok(Some(person))
        }
    }
}

fn number(id: &ImageId, entry: impl Fn() -> String) -> Result<u64, FileError> {
    id.number().ok_or_else(|| FileError::Entry {
        entry: entry(),
        got: id.to_string(),
        expected: "a number, or a text that ends in a number".to_owned(),
    })
}

#[cfg(test)]
mod tests;
