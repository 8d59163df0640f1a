//! The images for training, which are decoded, rotated and mirrored on demand.

use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, OrFail as _};
use footage::Fill;
use rayon::prelude::*;
use training::datasets::{Person, Picture, Sample, SkeletonTable};
use training::{Album, AlbumError};

use super::data::Data;

/// Fill of the pixels outside a rotated image: the border is repeated, so that there is no artificial edge that the model could
/// learn.
const FILL: Fill = Fill::Replicate;

/// All people, with rotated and mirrored copies, and the images without people.
#[derive(Debug)]
pub(super) struct Gallery {
    people: Vec<Person>,
    joint_mirror: Vec<usize>,
    copies: Vec<Copied>,
    /// Centres of the parts in every copy, in pixels of the copy.
    parts: Vec<Vec<[f64; 2]>>,
    negatives: Vec<PathBuf>,
    stamp: u64,
}

/// A rotated and mirrored copy of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Copied {
    person: usize,
    degrees: f64,
    mirrored: bool,
}

impl Gallery {
    /// Computes the positions of the parts in all copies.
    ///
    /// # Errors
    ///
    /// Fails if an image can no longer be decoded.
    pub(super) fn new(data: &Data, table: &SkeletonTable) -> Result<Self, Failure> {
        let joint_mirror = table.joint_mirror().to_vec();
        let of_person = |(person, (it, angles)): (usize, &(Person, Vec<f64>))| {
            let plain = Sample::read(it)?;
            let mut copies = Vec::new();
            for &degrees in angles {
                let turned = turned(&plain, degrees)?;
                let mut add = |mirrored, sample: &Sample| {
                    let copy = Copied {
                        person,
                        degrees,
                        mirrored,
                    };
                    copies.push((copy, table.parts_of(&sample.joints)));
                };
                add(false, &turned);
                if data.with_mirror {
                    add(true, &turned.mirrored(&joint_mirror));
                }
            }
            Ok::<_, AlbumError>(copies)
        };
        let people: Vec<_> = data.people.iter().enumerate().collect();
        let copies: Result<Vec<_>, AlbumError> = people.into_par_iter().map(of_person).collect();
        let (copies, parts) = copies.or_fail(ExitKind::Input)?.into_iter().flatten().unzip();
        let images = data.people.iter().map(|person| person.0.image.as_path());
        let files: Vec<&Path> = images.chain(data.negatives.iter().map(PathBuf::as_path)).collect();
        Ok(Self {
            stamp: stamp(&files),
            people: data.people.iter().map(|person| person.0.clone()).collect(),
            joint_mirror,
            copies,
            parts,
            negatives: data.negatives.clone(),
        })
    }

    /// Returns the centres of the parts in every copy, in pixels of the copy.
    pub(super) fn parts(&self) -> &[Vec<[f64; 2]>] {
        &self.parts
    }

    /// Returns the index of the person in a copy.
    pub(super) fn person_of(&self, copy: usize) -> usize {
        self.copies[copy].person
    }

    /// Returns a hash of the names and sizes of all image files.
    pub(super) fn stamp(&self) -> u64 {
        self.stamp
    }
}

impl Album for Gallery {
    fn person(&self, person: usize) -> Result<Picture, AlbumError> {
        let copy = self.copies[person];
        let plain = Sample::read(&self.people[copy.person])?;
        let turned = turned(&plain, copy.degrees)?;
        Ok(if copy.mirrored {
            turned.mirrored(&self.joint_mirror).image
        } else {
            turned.image
        })
    }

    fn n_backgrounds(&self) -> usize {
        self.negatives.len()
    }

    fn background(&self, image: usize) -> Result<Picture, AlbumError> {
        Ok(Picture::read(&self.negatives[image])?)
    }
}

fn turned(plain: &Sample, degrees: f64) -> Result<Sample, AlbumError> {
    Ok(if degrees == 0.0 {
        plain.clone()
    } else {
        plain.rotated(degrees, FILL)?
    })
}

/// Returns the FNV-1a hash of the names and lengths of files.
fn stamp(files: &[&Path]) -> u64 {
    let named = files.iter().flat_map(|file| {
        let length = std::fs::metadata(file).map_or(0, |metadata| metadata.len());
        let name = file.file_name().unwrap_or_default().as_encoded_bytes();
        name.iter().copied().chain(length.to_le_bytes())
    });
    formats::checksum::fnv1a_of(named)
}
