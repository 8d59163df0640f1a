//! Samples for a quality network: results of the single-view model on pictures with known joints.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use fmp::Model;
use rayon::prelude::*;
use training::datasets::{Picture, ReadOptions, Selection};
use training::networks::quality::sample::Sample;
use training::networks::quality::store::Samples;
use viewquality::TileShape;

use super::observer::Observer;
use super::replace::replace;
use super::work::Work;
use crate::failures::dataset_failure;
use crate::person::deal;
use crate::scenes::{Scenes, of_pictures};

/// Selection of pictures.
#[derive(Debug, Clone)]
pub struct Job {
    /// Annotated people: folders or files.
    pub datasets: Vec<PathBuf>,
    /// Selections of people to use; all people if empty. A selection may name its data set: `DATASET=SELECTION`.
    pub only: Vec<String>,
    /// Selections of people to leave out.
    pub without: Vec<String>,
    /// Synthetic scenes.
    pub scenes: Scenes,
    /// Shape of the network's tiles.
    pub tile: TileShape,
}

/// Number of samples, and number of pictures without a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Made {
    /// Number of samples.
    pub n: usize,
    /// Number of pictures without a sample.
    pub n_lost: usize,
}

/// Makes samples on rayon's current pool, and writes them. The samples do not depend on the number of threads.
///
/// # Errors
///
/// Fails if a data set, a picture or a scene cannot be used, if there is no sample, if the file cannot be written, or on a stop request
/// ([`ExitKind::Interrupted`]).
pub fn make(
    job: &Job,
    out: &Path,
    model: Arc<Model>,
    (stop, console): (Stop, &dyn Console),
) -> Result<Made, Failure> {
    let work = Work::new(Observer::new(model, job.tile), stop, console);
    let mut all = scenes(job, &work)?;
    all.extend(people(job, &work)?);
    let n = all.len();
    if n == 0 {
        return Err(Failure::new(ExitKind::Input, "no picture gave a sample"));
    }
    let samples = Samples {
        tile: [job.tile.height, job.tile.width],
        all,
    };
    let bytes = samples.to_bytes().or_fail(ExitKind::Run)?;
    replace(out, &bytes)?;
    let n_lost = work.n_lost();
    Ok(Made { n, n_lost })
}

/// Returns the samples of scenes.
fn scenes(job: &Job, work: &Work<'_>) -> Result<Vec<Sample>, Failure> {
    of_pictures(
        &job.scenes,
        &work.stop,
        |shown| {
            let named = (shown.group.to_owned(), shown.source.clone());
            let found = work.observer.observe(shown.picture, &shown.joints, named);
            found.ok()
        },
        |n, n_lost| work.done(n, n_lost),
    )
}

/// Returns the samples of data sets.
fn people(job: &Job, work: &Work<'_>) -> Result<Vec<Sample>, Failure> {
    let all = &job.datasets;
    let only = deal(all, "--only", &job.only, false)?;
    let without = deal(all, "--without", &job.without, false)?;
    let mut samples = Vec::new();
    for ((path, only), without) in all.iter().zip(only).zip(without) {
        let options = ReadOptions {
            only: selection(&only)?,
            without: selection(&without)?,
            n_joints: Some(skeleton::PARSE14.joints.len()),
            ..ReadOptions::default()
        };
        let read = training::datasets::read(path, &options).map_err(dataset_failure)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let found: Result<Vec<_>, Failure> = read
            .people
            .par_iter()
            .map(|person| {
                work.stop.check("stopped")?;
                let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
                let file = person.image.file_name().unwrap_or_default().to_string_lossy();
                let source = format!("{name} {file}");
                let named = (source.clone(), source);
                let found = work.observer.observe(picture.view(), &person.joints, named);
                work.done(1, usize::from(found.is_err()));
                Ok(found.ok())
            })
            .collect();
        samples.extend(found?.into_iter().flatten());
    }
    Ok(samples)
}

fn selection(values: &[&str]) -> Result<Option<Selection>, Failure> {
    let one = values.first().map(|value| Selection::from_argument(value));
    one.transpose().or_fail(ExitKind::Usage)
}
