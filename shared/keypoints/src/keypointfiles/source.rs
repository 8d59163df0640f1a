//! Reads the people of every frame.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::BODY_25;
use crate::files::{FileError, NameSet, SeenKeypoints, coco, openpose};

use crate::keypointfiles::error::KeypointFileError;
use crate::keypointfiles::folder;
use crate::keypointfiles::order::pelvis_off;

/// Maximum size of the file of one frame, in bytes; the next constant is the maximum size of the file of all frames.
const MOST_OF_FRAME: u64 = 16 << 20;
const MOST_OF_FILM: u64 = 1 << 30;
/// Number of files with people that are read to find out which set the 25 keypoints belong to.
const N_LOOKED_AT: usize = 20;

/// The keypoints of a film, by the numbers of its frames.
#[derive(Debug)]
pub struct KeypointSource {
    names: NameSet,
    n_frames: u64,
    frames: Frames,
}

#[derive(Debug)]
enum Frames {
    /// Files with ascending numbers, each read when its frame is requested.
    Files(Vec<(u64, PathBuf)>),
    /// Frames that have already been read.
    Read(BTreeMap<u64, Vec<SeenKeypoints>>),
}

impl KeypointSource {
    /// Opens a folder of JSON files in OpenPose's layout, or one JSON file in COCO's.
    ///
    /// The frame number of a file is the last number in its name, minus the lowest such number in the folder. If a number has no file, its
    /// frame has no keypoints. Files that do not end in `.json` are ignored.
    ///
    /// * `names`: names of the keypoints. If `None`, they are derived from the number of keypoints or from the category in the files. To do
    ///   so, the files of a folder are read up to the first person, or a few more.
    ///
    /// # Errors
    ///
    /// Returns a [`KeypointFileError`], which names the file.
    pub fn open(path: &Path, names: Option<NameSet>) -> Result<Self, KeypointFileError> {
        if path.is_dir() {
            return Self::folder(path, names);
        }
        let text = read(path, MOST_OF_FILM)?;
        let film = coco::parse(&text, names.as_ref()).map_err(|source| in_file(path, source))?;
        if names.is_none() && is_body_25(&film.names) {
            checked(path, &mut film.frames.values().flatten())?;
        }
        Ok(Self {
            names: film.names,
            n_frames: film.n_frames,
            frames: Frames::Read(film.frames),
        })
    }

    fn folder(path: &Path, names: Option<NameSet>) -> Result<Self, KeypointFileError> {
        let files = folder::files(path)?;
        let names = match names {
            Some(names) => names,
            None => told(path, &files)?,
        };
        Ok(Self {
            names,
            n_frames: files.last().map_or(0, |file| file.0 + 1),
            frames: Frames::Files(files),
        })
    }

    /// Returns the names of the keypoints.
    pub fn names(&self) -> &NameSet {
        &self.names
    }

    /// Returns the number of frames: one more than the highest number in the files.
    pub fn n_frames(&self) -> u64 {
        self.n_frames
    }

    /// Reads the people of a frame, counted from 0, in the order of its file.
    ///
    /// Returns the number of people; `None` if the frame is not in the files (in a gap, or after the end).
    ///
    /// * `people`: replaced by the people of the frame; empty if there are none.
    ///
    /// # Errors
    ///
    /// Returns a [`KeypointFileError`] if a file cannot be read. `people` is then empty, and other frames can still be read.
    pub fn of_frame(
        &self,
        frame: u64,
        people: &mut Vec<SeenKeypoints>,
    ) -> Result<Option<usize>, KeypointFileError> {
        people.clear();
        match &self.frames {
            Frames::Read(frames) => {
                let Some(seen) = frames.get(&frame) else {
                    return Ok(None);
                };
                people.extend_from_slice(seen);
            }
            Frames::Files(files) => {
                let Ok(at) = files.binary_search_by_key(&frame, |file| file.0) else {
                    return Ok(None);
                };
                let path = &files[at].1;
                let text = read(path, MOST_OF_FRAME)?;
                let seen = openpose::parse(&text, Some(&self.names));
                *people = seen.map_err(|source| in_file(path, source))?.people;
            }
        }
        Ok(Some(people.len()))
    }
}

/// Returns the names that are derived from the first file with a person.
fn told(folder: &Path, files: &[(u64, PathBuf)]) -> Result<NameSet, KeypointFileError> {
    let mut told: Option<NameSet> = None;
    let mut people = Vec::new();
    let mut n_looked_at = 0;
    for (_, path) in files {
        let text = read(path, MOST_OF_FRAME)?;
        let frame = openpose::parse(&text, told.as_ref()).map_err(|error| in_file(path, error))?;
        told = frame.names;
        let Some(names) = &told else { continue };
        people.extend(frame.people);
        n_looked_at += 1;
        if n_looked_at == N_LOOKED_AT || !is_body_25(names) {
            break;
        }
    }
    let names = told.ok_or_else(|| KeypointFileError::Nobody {
        path: folder.to_owned(),
    })?;
    if is_body_25(&names) {
        checked(folder, &mut people.iter())?;
    }
    Ok(names)
}

fn is_body_25(names: &NameSet) -> bool {
    names.names() == BODY_25
}

/// Returns an error for 25 keypoints that are not those of `body-25`.
fn checked(
    path: &Path,
    people: &mut dyn Iterator<Item = &SeenKeypoints>,
) -> Result<(), KeypointFileError> {
    match pelvis_off(people) {
        None => Ok(()),
        Some(off) => Err(KeypointFileError::NotBody25 {
            path: path.to_owned(),
            off,
        }),
    }
}

fn in_file(path: &Path, source: FileError) -> KeypointFileError {
    KeypointFileError::File {
        path: path.to_owned(),
        source,
    }
}

/// Reads the bytes of a file, but not more than `most`, regardless of its stated size.
fn read(path: &Path, most: u64) -> Result<Vec<u8>, KeypointFileError> {
    let failed = |source| KeypointFileError::Read {
        path: path.to_owned(),
        source,
    };
    let file = files::open(path).map_err(failed)?;
    let bytes = file.metadata().map_err(failed)?.len();
    let mut text = Vec::new();
    if bytes <= most {
        file.take(most + 1).read_to_end(&mut text).map_err(failed)?;
    }
    let bytes = bytes.max(text.len() as u64);
    if bytes > most {
        return Err(KeypointFileError::TooLarge {
            path: path.to_owned(),
            bytes,
            most,
        });
    }
    Ok(text)
}

#[cfg(test)]
mod tests;
