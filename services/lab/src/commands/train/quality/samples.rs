//! `parallax-lab train quality-samples`: makes training samples from pictures with known joints.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::quality::{Scenes, samples};
use viewquality::TileShape;

use crate::commands::pool;
use crate::commands::train::subjects;
use terminal::{Globals, Terminal, output};

const HELP: &str = "\
The samples come from one or both of two sources: synthetic scenes (--scenes N) with the people of --subjects, and DATASETs of annotated people as \
for `parallax-lab train fmp`. The seed chooses action, rig, room, noise, blur and exposure of each scene. Every picture is \
searched as in the pipeline. A sample consists of the tile (the best pose and a margin around it), the results of the search, and \
the error of every part.

Put the subjects and images for the evaluation of the network into a separate file.

Example:
    parallax-lab train quality-samples --scenes 200 --subjects 1-100 --out train.samples
    parallax-lab train quality-samples --scenes 40 --subjects 901-920 --seed 2 --out test.samples";

/// Network for which the tiles are made.
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

/// Options of `train quality-samples`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Annotated people: folders or files, as for `train fmp`.
    #[arg(value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// People of a data set to use. If not given, all are used.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    only: Vec<String>,
    /// People of a data set to leave out, for example its test set.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    without: Vec<String>,
    /// Number of synthetic scenes. Each scene gives several pictures from every camera.
    #[arg(long, value_name = "N", default_value_t = 0)]
    scenes: u32,
    /// First and last number of the synthetic people in the scenes.
    #[arg(long, value_name = "FROM-TO", default_value = "1-100", value_parser = subjects)]
    subjects: [u64; 2],
    /// Number of frames per camera in a scene. The frames are a few seconds apart.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=100))]
    frames: u16,
    /// Folder of photographs without people. They replace the room as the background of every third scene.
    #[arg(long, value_name = "DIR")]
    backdrop: Option<PathBuf>,
    /// Random seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Single-view model. If not given, the shipped person model.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Network for which the tiles are made.
    #[arg(long, value_enum, default_value_t = TileOf::Small)]
    tile: TileOf,
    /// File of samples to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Number of threads, which does not affect the samples. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.scenes == 0 && arguments.datasets.is_empty() {
        let failure = Failure::new(
            ExitKind::Usage,
            "no pictures: name a DATASET, or use --scenes N",
        );
        return Err(failure);
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let pool = pool(arguments.threads, "samples")?;
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let job = samples::Job {
        datasets: arguments.datasets.clone(),
        only: arguments.only.clone(),
        without: arguments.without.clone(),
        scenes: Scenes {
            n: arguments.scenes,
            subjects: arguments.subjects,
            frames: arguments.frames,
            company: 0,
            backdrop: arguments.backdrop.clone(),
            seed: arguments.seed,
        },
        tile: arguments.tile.shape(),
    };
    let terminal = Terminal::without_bar(globals.quiet, false);
    let made = pool.install(|| samples::make(&job, &arguments.out, model, (stop, &terminal)))?;
    if !globals.quiet {
        output::message(format_args!(
            "{}: {} samples, {} pictures without a detected person",
            arguments.out.display(),
            made.n,
            made.n_lost
        ));
    }
    Ok(ExitCode::SUCCESS)
}
