//! Training data of a model: people of several data sets, and images without people.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, OrFail as _};
use rayon::prelude::*;
use training::datasets::{
    FaultKind, People, Person, Picture, ReadOptions, Selection, Sides, SkeletonTable,
};

use super::per_dataset::deal;
use super::progress::Progress;
use crate::failures::dataset_failure;
use inputs::images;

/// Selection of people and of images without people, and options for their use.
///
/// Values of `only`, `without`, `sides` and `rotate` may name their data set as written in `datasets`:
/// `DATASET=VALUE`.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    /// Annotated people: folders or files.
    pub datasets: Vec<PathBuf>,
    /// Folders of images without people; all images are used.
    pub negatives: Vec<PathBuf>,
    /// Selections of people for training; all people if empty.
    pub only: Vec<String>,
    /// Selections of people to leave out.
    pub without: Vec<String>,
    /// Meaning of left and right in the labels: `marked` or `seen`.
    pub sides: Vec<String>,
    /// Angles of rotated copies, in degrees, anticlockwise, separated by commas.
    pub rotate: Vec<String>,
    /// True to train on mirror images too.
    pub with_mirror: bool,
    /// Kinds of bad labels that end the training, instead of leaving the person out.
    pub fatal: Vec<FaultKind>,
}

/// Parses the parts of a model and their positions between the joints.
///
/// * `file`: file of the text, for messages.
///
/// # Errors
///
/// Fails if the text is not a skeleton table.
pub fn parse_skeleton(file: &Path, text: &str) -> Result<SkeletonTable, Failure> {
    SkeletonTable::parse(text).map_err(|error| {
        let message = format!(
            "{}: {}",
            file.display(),
            failure::wording::in_one_line(&error)
        );
        Failure::new(ExitKind::Input, message)
    })
}

/// All training data.
#[derive(Debug)]
pub(super) struct Data {
    /// All usable people, in the order of the data sets, with the angles of their copies; the first angle is 0.
    pub(super) people: Vec<(Person, Vec<f64>)>,
    /// Number of people who were left out, for each kind of bad label.
    pub(super) left_out: BTreeMap<&'static str, usize>,
    /// True to train on mirror images too.
    pub(super) with_mirror: bool,
    /// Images without people that can be decoded.
    pub(super) negatives: Vec<PathBuf>,
    /// Number of images without people that cannot be decoded.
    pub(super) n_unreadable: usize,
}

impl Data {
    /// Reads and checks all data.
    ///
    /// # Errors
    ///
    /// Fails if a data set or a selection cannot be read, if a person has a bad label of a fatal kind, or if no people
    /// or no images without people are left.
    pub(super) fn read(
        arguments: &Chosen,
        table: &SkeletonTable,
        progress: &Progress,
    ) -> Result<Self, Failure> {
        let mut data = Self {
            people: Vec::new(),
            left_out: BTreeMap::new(),
            with_mirror: arguments.with_mirror,
            negatives: Vec::new(),
            n_unreadable: 0,
        };
        let options = read_options(arguments, table)?;
        let all = &arguments.datasets;
        let angles = deal(all, "--rotate", &arguments.rotate, true)?;
        let sides = deal(all, "--sides", &arguments.sides, true)?;
        for (((path, options), angles), sides) in all.iter().zip(&options).zip(angles).zip(sides) {
            let angles = degrees(&angles)?;
            let sides = sides_of(&sides)?;
            let People { people, problems } =
                training::datasets::read(path, options).map_err(dataset_failure)?;
            let people = people.into_iter();
            let people = people.map(|person| sides.of(person, table.joint_mirror()));
            for problem in problems {
                *data.left_out.entry(problem.fault.kind().name()).or_default() += 1;
                progress.left_out(&problem)?;
            }
            data.people.extend(people.map(|person| (person, angles.clone())));
        }
        if data.people.is_empty() {
            let n: usize = data.left_out.values().sum();
            let message = format!("no person is left to train on: all {n} people were left out");
            return Err(Failure::new(ExitKind::Input, message));
        }
        data.negatives(&arguments.negatives, progress)?;
        Ok(data)
    }

    /// Decodes every image once, to check that this is possible.
    fn negatives(&mut self, folders: &[PathBuf], progress: &Progress) -> Result<(), Failure> {
        let images = in_folders(folders)?;
        let read: Vec<_> = images.par_iter().map(|image| Picture::read(image).err()).collect();
        for (image, error) in images.into_iter().zip(read) {
            match error {
                None => self.negatives.push(image),
                Some(error) => {
                    self.n_unreadable += 1;
                    progress.unreadable(&image, &error)?;
                }
            }
        }
        if self.negatives.is_empty() {
            let n = self.n_unreadable;
            let message = format!("none of {n} images without people can be read");
            return Err(Failure::new(ExitKind::Input, message));
        }
        Ok(())
    }
}

/// Returns all images in folders, by name.
pub(super) fn in_folders(folders: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    if let Some(folder) = folders.iter().find(|folder| !folder.is_dir()) {
        let message = format!(
            "{}: this is not a folder of images without people",
            folder.display()
        );
        return Err(Failure::new(ExitKind::Input, message));
    }
    images::listed(folders)
}

/// Returns the options for reading each data set.
pub(crate) fn read_options(
    arguments: &Chosen,
    table: &SkeletonTable,
) -> Result<Vec<ReadOptions>, Failure> {
    let all = &arguments.datasets;
    if let Some((_, twice)) = (1..).zip(all).find(|&(after, path)| all[after..].contains(path)) {
        let message = format!("{}: the data set is named twice", twice.display());
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let only = deal(all, "--only", &arguments.only, false)?;
    let without = deal(all, "--without", &arguments.without, false)?;
    only.iter()
        .zip(&without)
        .map(|(only, without)| {
            Ok(ReadOptions {
                only: selection("--only", only)?,
                without: selection("--without", without)?,
                n_joints: Some(table.n_joints()),
                fatal: arguments.fatal.clone(),
                ..ReadOptions::default()
            })
        })
        .collect()
}

/// Returns the selection. Fails if there are several.
fn selection(option: &str, values: &[&str]) -> Result<Option<Selection>, Failure> {
    match values {
        [] => Ok(None),
        [one] => Ok(Some(
            Selection::from_argument(one).or_fail(ExitKind::Usage)?,
        )),
        _ => {
            let message = format!("{option} is given more than once for one data set");
            Err(Failure::new(ExitKind::Usage, message)
                .with_hint("combine the values, for example 1-100,150"))
        }
    }
}

/// Returns the angles of the rotated copies, without duplicates and starting with 0.
fn degrees(values: &[&str]) -> Result<Vec<f64>, Failure> {
    let mut angles = vec![0.0];
    for text in values.iter().flat_map(|value| value.split(',')) {
        let angle = text.trim().parse::<f64>().ok();
        let angle = angle.filter(|angle| angle.abs() <= 180.0).ok_or_else(|| {
            let message = format!("--rotate {text}: expected degrees between -180 and 180");
            Failure::new(ExitKind::Usage, message)
        })?;
        if !angles.contains(&angle) {
            angles.push(angle);
        }
    }
    Ok(angles)
}

/// Returns the meaning of left and right in a data set. If several values are given, the last one is used.
pub(crate) fn sides_of(values: &[&str]) -> Result<Sides, Failure> {
    let Some(name) = values.last() else {
        return Ok(Sides::default());
    };
    name.parse().map_err(|error| {
        let message = format!("--sides {name}: {error}");
        Failure::new(ExitKind::Usage, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_and_right_are_as_marked_by_default() {
        assert_eq!(sides_of(&[]).unwrap(), Sides::Marked);
        assert_eq!(sides_of(&["marked", "seen"]).unwrap(), Sides::Seen);
        assert_eq!(sides_of(&["left"]).unwrap_err().kind(), ExitKind::Usage);
    }

    #[test]
    fn the_list_of_angles_begins_with_0_and_has_no_duplicates() {
        let angles = degrees(&["-15,-7.5", "7.5, 0,-15"]).unwrap();
        assert_eq!(angles, [0.0, -15.0, -7.5, 7.5]);
        for wrong in ["", "a", "nan", "inf", "181"] {
            assert_eq!(degrees(&[wrong]).unwrap_err().kind(), ExitKind::Usage);
        }
    }
}
