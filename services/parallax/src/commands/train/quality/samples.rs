//! `parallax train quality-samples`: what the single-view model makes of pictures with known joints.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use datasets::{Picture, ReadOptions, Selection};
use qualitytraining::sample::Sample;
use qualitytraining::store::Samples;
use rayon::prelude::*;
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use viewquality::TileShape;

use super::super::{data::unread, per_dataset::deal};
use super::observer::Observer;
use super::scenes;
use crate::globals::Globals;
use crate::{inputs, output};

const HELP: &str = "\
Two sources, together or alone: scenes that do not exist (--scenes N, of the subjects of --subjects, every one of \
another action, rig, room, noise, blur and exposure, by the seed), and DATASETs of annotated people as for \
`parallax train fmp`. Every picture is searched as the pipeline does; what is kept of it is the tile around \
the best pose with a margin, what the search knows of the pose, and how far off every part is.

Subjects and images that the network is to be judged on belong into a file of their own.

Example:
    parallax train quality-samples --scenes 200 --subjects 1-100 --out train.samples
    parallax train quality-samples --scenes 40 --subjects 901-920 --seed 2 --out test.samples";

/// Which network the tiles are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TileOf {
    /// 160 x 64 pixels.
    Small,
    /// 160 x 48 pixels.
    Vgg16,
}

impl TileOf {
    fn shape(self) -> TileShape {
        match self {
            Self::Small => TileShape::SMALL,
            Self::Vgg16 => TileShape::VGG16,
        }
    }
}

/// Which pictures, and where to.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Annotated people: folders or files, as for `train fmp`.
    #[arg(value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Who of a data set is used, everybody if not given.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    only: Vec<String>,
    /// Who of a data set is left out: a test set.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    without: Vec<String>,
    /// Number of scenes that do not exist; each gives some pictures of every camera.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) scenes: u32,
    /// Numbers of the people in the scenes.
    #[arg(long, value_name = "FROM-TO", default_value = "1-100", value_parser = scenes::subjects)]
    pub(super) subjects: [u64; 2],
    /// Frames of every camera of a scene, some seconds apart.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=100))]
    pub(super) frames: u16,
    /// Photographs without people that stand in the place of every third room.
    #[arg(long, value_name = "DIR")]
    pub(super) backdrop: Option<PathBuf>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// The single-view model; the person model that ships with Parallax if not given.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Which network the tiles are for.
    #[arg(long, value_enum, default_value_t = TileOf::Small)]
    tile: TileOf,
    /// The file of samples to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Threads; one a core if not given. The samples do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
}

/// Makes the samples.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.scenes == 0 && arguments.datasets.is_empty() {
        let failure = Failure::new(
            ExitKind::Usage,
            "no pictures: name a DATASET, or --scenes N",
        );
        return Err(failure);
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads.map_or(0, usize::from))
        .thread_name(|it| format!("samples-{it}"))
        .build()
        .or_fail(ExitKind::Run)?;
    let shape = arguments.tile.shape();
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let work = Work {
        observer: Observer::new(model, shape),
        stop,
        quiet: globals.quiet,
        n_done: AtomicUsize::new(0),
        n_lost: AtomicUsize::new(0),
    };
    let all = pool.install(|| -> Result<Vec<Sample>, Failure> {
        let mut all = scenes::samples(arguments, &work)?;
        all.extend(people(arguments, &work)?);
        Ok(all)
    })?;
    let n = all.len();
    if n == 0 {
        return Err(Failure::new(
            ExitKind::Input,
            "not one picture makes a sample",
        ));
    }
    let samples = Samples {
        tile: [shape.height, shape.width],
        all,
    };
    let bytes = samples.to_bytes().or_fail(ExitKind::Run)?;
    super::replace(&arguments.out, &bytes)?;
    if !globals.quiet {
        let n_lost = work.n_lost.load(Ordering::Relaxed);
        output::message(format_args!(
            "{}: {n} samples, {n_lost} pictures on which nobody was found",
            arguments.out.display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// What all threads share.
pub(super) struct Work {
    pub(super) observer: Observer,
    stop: Stop,
    quiet: bool,
    n_done: AtomicUsize,
    n_lost: AtomicUsize,
}

impl Work {
    /// Stops where that was asked for.
    pub(super) fn go_on(&self) -> Result<(), Failure> {
        if self.stop.is_requested() {
            return Err(Failure::new(ExitKind::Interrupted, "stopped"));
        }
        Ok(())
    }

    /// Takes note of pictures that were looked at.
    pub(super) fn done(&self, n: usize, n_lost: usize) {
        const EVERY: usize = 100;
        self.n_lost.fetch_add(n_lost, Ordering::Relaxed);
        let before = self.n_done.fetch_add(n, Ordering::Relaxed);
        if !self.quiet && before / EVERY != (before + n) / EVERY {
            output::message(format_args!("{} pictures", before + n));
        }
    }
}

/// The samples of data sets.
fn people(arguments: &Arguments, work: &Work) -> Result<Vec<Sample>, Failure> {
    let all = &arguments.datasets;
    let only = deal(all, "--only", &arguments.only, false)?;
    let without = deal(all, "--without", &arguments.without, false)?;
    let mut samples = Vec::new();
    for ((path, only), without) in all.iter().zip(only).zip(without) {
        let options = ReadOptions {
            only: selection(&only)?,
            without: selection(&without)?,
            n_joints: Some(skeleton::PARSE14.joints.len()),
            ..ReadOptions::default()
        };
        let read = datasets::read(path, &options).map_err(unread)?;
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let found: Result<Vec<_>, Failure> = read
            .people
            .par_iter()
            .map(|person| {
                work.go_on()?;
                let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
                let file = person
                    .image
                    .file_name()
                    .unwrap_or_default()
                    .to_string_lossy();
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
    let one = values.first().map(|it| Selection::from_argument(it));
    one.transpose().or_fail(ExitKind::Usage)
}
