//! Photographs of annotated people, to which a teacher adds the other people, and photographs without people.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use failure::{Console, ExitKind, Failure, OrFail as _};
use keypoints::PersonBox;
use posenetwork::Detector;
use training::datasets::{Person, Picture as Read, ReadOptions, SkeletonTable};
use training::networks::finder::Picture;

use super::reduced::{Box4, reduced};
use super::{Sources, around_joints};
use crate::failures::dataset_failure;
use crate::person::read_options;

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
    go_on: &(dyn Fn() -> Result<(), Failure> + Sync),
    console: &dyn Console,
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
        let read = read_all(&photographs, &sources.teachers, &|| {
            console.advance(1);
            go_on()
        });
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

/// Reads photographs on separate threads. The reason is explained in `posetraining`.
fn read_all(
    photographs: &[Photograph],
    teachers: &[Detector],
    go_on: &(dyn Fn() -> Result<(), Failure> + Sync),
) -> Result<Vec<Picture>, Failure> {
    let n_threads = match teachers.len() {
        0 => rayon::current_num_threads(),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let of_thread = |teacher: Option<&Detector>| {
        let mut found = Vec::new();
        let mut values = Vec::new();
        loop {
            let nth = next.fetch_add(1, Ordering::Relaxed);
            let Some(photograph) = photographs.get(nth) else {
                return Ok::<_, Failure>(found);
            };
            go_on()?;
            found.push((nth, read(photograph, teacher, &mut values)?));
        }
    };
    let of_thread = &of_thread;
    let found: Result<Vec<_>, Failure> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..n_threads)
            .map(|nth| scope.spawn(move || of_thread(teachers.get(nth))))
            .collect();
        let died = || {
            Err(Failure::new(
                ExitKind::Run,
                "a thread that reads photographs has panicked",
            ))
        };
        let join =
            |thread: std::thread::ScopedJoinHandle<'_, _>| thread.join().unwrap_or_else(|_| died());
        threads.into_iter().map(join).collect()
    });
    let mut found: Vec<(usize, Picture)> = found?.into_iter().flatten().collect();
    found.sort_by_key(|(nth, _)| *nth);
    Ok(found.into_iter().map(|(_, picture)| picture).collect())
}

fn read(
    photograph: &Photograph,
    teacher: Option<&Detector>,
    values: &mut Vec<f32>,
) -> Result<Picture, Failure> {
    let picture = Read::read(&photograph.file).or_fail(ExitKind::Input)?;
    let mut people = Vec::new();
    if let Some(marked) = &photograph.marked {
        people.extend(marked.iter().map(|outline| (*outline, true)));
        let found = teacher.map(|teacher| teacher.people(picture.view(), values));
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
