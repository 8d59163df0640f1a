//! Photographs of annotated people, to which a teacher adds the other people, and photographs without people.

use std::path::{Path, PathBuf};

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use keypoints::PersonBox;
use posenetwork::Detector;
use training::datasets::{Person, Picture as Read, ReadOptions, SkeletonTable};
use training::networks::finder::Picture;

use super::reduced::{Box4, reduced};
use super::{Sources, around_joints};
use crate::failures::dataset_failure;
use crate::person::read_options;
use crate::prepared::on_threads;

/// Score above which a box of the teacher counts as a person. Boxes with a lower score are ignored.
const SURE: f64 = 0.4;
/// Overlap above which a box of the teacher shows a marked person: the shared area as a fraction of the union of both boxes. A box of the
/// teacher that is mostly within a marked box also counts as the marked person's box.
const SAME: f64 = 0.4;
/// Distance by which a joint may be outside the picture, in pixels. In manual annotations, invisible joints can be anywhere.
const ANYWHERE_PX: f64 = 1e5;

/// A photograph, and the boxes of the marked people; `None` if it shows no people.
struct Photograph {
    file: PathBuf,
    marked: Option<Vec<[f64; 4]>>,
}

/// Returns the photographs of every data set, then those without people.
pub(super) fn pictures(
    sources: &Sources,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<Vec<Picture>>, Failure> {
    let chosen = &sources.photographs;
    let options = read_options(chosen, &SkeletonTable::published())?;
    let mut all = Vec::new();
    for (path, options) in chosen.datasets.iter().zip(options) {
        let options = ReadOptions {
            outside_px: ANYWHERE_PX,
            ..options
        };
        let read = training::datasets::read(path, &options).map_err(dataset_failure)?;
        all.push((path, photographs(&read.people)));
    }
    if let Some(folder) = &sources.empty {
        let files = inputs::images::listed(core::slice::from_ref(folder))?.into_iter();
        let empty = files.map(|file| Photograph { file, marked: None });
        all.push((folder, empty.collect()));
    }
    let mut pictures = Vec::new();
    for (path, photographs) in all {
        console.begin(&crate::eval::pictures::name(path), "photographs");
        console.set(0, photographs.len());
        let task = "reads photographs";
        let read = on_threads(
            &photographs,
            &sources.teachers,
            task,
            |photograph, teacher| {
                console.advance(1);
                stop.check("stopped")?;
                read(photograph, teacher)
            },
        );
        console.finish();
        pictures.push(read?);
    }
    Ok(pictures)
}

/// Returns photographs with the boxes of all people marked in them.
fn photographs(people: &[Person]) -> Vec<Photograph> {
    let mut all: Vec<Photograph> = Vec::new();
    for person in people {
        let visible = person.joints.iter().zip(&person.visible);
        let visible = visible.filter(|(_, is_visible)| **is_visible);
        let Some(outline) = around_joints(visible.map(|(at, _)| *at)) else {
            continue;
        };
        match all.last_mut() {
            Some(last) if last.file == person.image => {
                last.marked.get_or_insert_default().push(outline);
            }
            _ => all.push(Photograph {
                file: person.image.clone(),
                marked: Some(vec![outline]),
            }),
        }
    }
    all
}

fn read(photograph: &Photograph, teacher: Option<&Detector>) -> Result<Picture, Failure> {
    let picture = Read::read(&photograph.file).or_fail(ExitKind::Input)?;
    let mut people = Vec::new();
    if let Some(marked) = &photograph.marked {
        people.extend(marked.iter().map(|outline| (*outline, true)));
        let found = teacher.map(|teacher| teacher.people(picture.view(), &mut Vec::new()));
        let found = found.transpose().or_fail(ExitKind::Input)?;
        people.extend(added(marked, &found.unwrap_or_default()));
    }
    Ok(reduced(name(&photograph.file), picture.view(), &people))
}

fn name(file: &Path) -> String {
    file.display().to_string()
}

/// Returns the boxes of the teacher around people who are not marked.
fn added(marked: &[[f64; 4]], found: &[PersonBox]) -> Vec<Box4> {
    let others = found.iter().filter(|found| {
        let mut marked = marked.iter();
        !marked.any(|marked| is_same(marked, &found.outline))
    });
    others.map(|found| (found.outline, found.score >= SURE)).collect()
}

fn is_same(a: &[f64; 4], b: &[f64; 4]) -> bool {
    let area =
        |[left, top, right, bottom]: [f64; 4]| (right - left).max(0.0) * (bottom - top).max(0.0);
    let shared = area([
        a[0].max(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].min(b[3]),
    ]);
    shared > SAME * (area(*a) + area(*b) - shared) || shared > 0.8 * area(*b)
}
