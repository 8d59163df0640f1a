//! `parallax-lab train`: trains models, networks and multi-view consistency.

mod consistency;
mod finder;
mod joints;
mod learning;
mod marked;
mod network;
mod orientation;
mod people;
mod quality;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, Subcommand};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::person::{Job, Progress, Store};
use training::Settings;

use crate::commands::{pool, read_settings};
use people::People;
use terminal::{Globals, Terminal, output};

/// The template of the progress bar.
const BAR: &str = "{elapsed_precise} {prefix} {bar:20} {pos}/{len} images{msg}";

const HELP: &str = "\
DATASET is a folder with labels.mat (PARSE) or joints.mat (LSP), one of these files, or a file of \
JSON lines. Each line describes one person; image paths are relative to the file:
    {\"image\": \"7.jpg\", \"joints\": [[31.5, 80.0], ...], \"visible\": [true, ...], \"name\": \"ann\"}
`visible` and `name` are optional. The centre of the top-left pixel is (0, 0). Unless --skeleton \
names other joints, they are the 14 of PARSE and LSP: right ankle, knee, hip, left hip, knee, \
ankle, right wrist, elbow, shoulder, left shoulder, elbow, wrist, neck, top of the head.

In the model, left and right are sides of the picture, as in the labels of PARSE. For people seen from behind, LSP and \
LSP-extended label the sides of the body instead; --sides LSP=seen corrects that.

Rows of a data set are counted from 1. With several data sets, the values of --only, --without, --rotate and --sides begin with a data set as \
written on the command line: --only PARSE=1-100. A selection is a list of rows (1-100,150) or a file. Each line of the \
file has a row, a range of rows or the file name of an image; all of these must exist.

The training consists of many steps. After each step, its state is saved in OUT.checkpoint. After Ctrl-C or a kill, \
--resume continues from the last finished step. The resulting model is the same, bit for bit, on any number of threads.

Kinds of bad labels, for --fatal: syntax, count, unknown, not-finite, zero-size, image, outside, \
twice, same-name. People with bad labels of other kinds are reported with file and row, and left out.

With --json, standard output has one object per line and nothing else:
    {\"event\": \"left-out\" | \"unreadable\" | \"data\" | \"resumed\" | \"step\" | \"summary\", ...}

Exit codes: 0 the model is written; 2 the command line is wrong, or an interrupted training is in \
the way; 3 a setting is wrong; 4 a data set or the checkpoint cannot be used, or a label is bad in a way that --fatal lists; 130 stopped by Ctrl-C.

Examples:
    parallax-lab train fmp PARSE --only 1-100 --rotate -15,-7.5,7.5,15 \\
        --negatives INRIA/neg --out person.fmp
    parallax-lab train fmp PARSE lsp/joints.mat --only PARSE=1-100 --rotate PARSE=-15,15 \\
        --sides lsp/joints.mat=seen --without lsp/joints.mat=held-out.txt \\
        --negatives INRIA/neg --judge holiday-photos --out person.fmp
    parallax-lab train fmp --print-settings > settings.toml
    parallax-lab judge person.fmp PARSE --only 101-200";

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Train a flexible mixture of parts: the model that finds people in single views.
    Fmp(Box<Arguments>),
    /// Learn the consistency between several views of a person: part types, weights, thresholds, joints.
    Consistency(Box<consistency::Arguments>),
    /// Train the network that estimates the direction in which a person faces, to distinguish left from right.
    Orientation(Box<orientation::Arguments>),
    /// Learn the positions of joints relative to the parts of a model, from photographs of annotated people.
    Joints(Box<joints::Arguments>),
    /// Prepare people for training the network that finds joints.
    NetworkPeople(Box<network::people::Arguments>),
    /// Train the network that estimates joints, the direction of the trunk, and expected errors.
    Network(Box<network::learn::Arguments>),
    /// Prepare pictures for training the network that finds people.
    FinderPictures(Box<finder::pictures::Arguments>),
    /// Train the network that finds people in whole pictures.
    Finder(Box<finder::learn::Arguments>),
    /// Train a network that predicts the error of every part in a single view.
    Quality(Box<quality::network::Arguments>),
    /// Search pictures with known joints, and write samples to train the quality network.
    QualitySamples(Box<quality::samples::Arguments>),
}

/// Options of `train fmp`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Options for the training data.
    #[command(flatten)]
    data: People,
    /// Model file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    out: Option<PathBuf>,
    /// Settings of the training, as TOML; --print-settings shows the keys and their defaults.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings of the training as TOML, and exit.
    #[arg(long)]
    print_settings: bool,
    /// Random seed. It overrides the seed in the settings.
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Number of threads, which does not affect the model. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Folder of images without people, to count false alarms after the training. If not given, the images of --negatives.
    #[arg(long, value_name = "DIR")]
    judge: Option<PathBuf>,
    /// Continue from the checkpoint of an interrupted training. If there is no checkpoint, start from the beginning.
    #[arg(long)]
    resume: bool,
    /// Print events and the summary as JSON, one object per line.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand until the model is written or a stop is requested.
pub(crate) fn run(command: Command, globals: Globals) -> Result<ExitCode, Failure> {
    let arguments = match command {
        Command::Fmp(it) => it,
        Command::Consistency(it) => return consistency::run(&it, globals),
        Command::Orientation(arguments) => return orientation::run(&arguments, globals),
        Command::Joints(it) => return joints::run(&it, globals),
        Command::NetworkPeople(it) => return network::people::run(&it, globals),
        Command::Network(it) => return network::learn::run(&it, globals),
        Command::FinderPictures(arguments) => return finder::pictures::run(&arguments, globals),
        Command::Finder(arguments) => return finder::learn::run(&arguments, globals),
        Command::Quality(arguments) => return quality::network::run(&arguments, globals),
        Command::QualitySamples(arguments) => return quality::samples::run(&arguments, globals),
    };
    let settings = settings(&arguments)?;
    if arguments.print_settings {
        output::line(toml::to_string(&settings).or_fail(ExitKind::Run)?.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    let out = arguments.out.clone().unwrap_or_default();
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let shared = Arc::new(Shared {
        store: Store::new(&out, arguments.resume)?,
        progress: Progress::new(
            stop.clone(),
            Box::new(Terminal::with_bar(globals.quiet, arguments.json, BAR).ticking()),
        ),
        quiet: globals.quiet,
    });
    let pool = pool(arguments.threads, "train")?;
    let worker = Arc::clone(&shared);
    let done = failure::unless_stopped(&stop, move || {
        pool.install(|| work(&arguments, &settings, &worker))
    })?;
    shared.progress.finish();
    match done {
        Some(Err(failure)) if failure.kind() != ExitKind::Interrupted => Err(failure),
        Some(Ok(code)) => Ok(code),
        _ => Err(shared.store.interrupted()),
    }
}

/// State shared by the training thread and the thread that waits for it.
struct Shared {
    store: Store,
    progress: Progress,
    quiet: bool,
}

fn settings(arguments: &Arguments) -> Result<Settings, Failure> {
    let mut settings: Settings = read_settings(arguments.settings.as_deref())?;
    if let Some(seed) = arguments.seed {
        settings.seed = u64::from(seed);
    }
    // Without mirrored images, left and right parts need not be symmetric.
    settings.symmetric &= arguments.data.with_mirror();
    settings.check().or_fail(ExitKind::Config)?;
    Ok(settings)
}

fn work(arguments: &Arguments, settings: &Settings, shared: &Shared) -> Result<ExitCode, Failure> {
    let job = Job {
        data: arguments.data.chosen(),
        skeleton: arguments.data.table()?,
        settings: settings.clone(),
        judge: arguments.judge.clone(),
        resume: arguments.resume,
    };
    let report = lab::person::train(&job, &shared.store, &shared.progress)?;
    if arguments.json {
        output::json(&report.json())?;
    } else if !shared.quiet {
        output::line(report.text())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Parses `FROM-TO`.
fn subjects(text: &str) -> Result<[u64; 2], String> {
    let ends = text.split_once('-').unwrap_or((text, text));
    match (ends.0.trim().parse(), ends.1.trim().parse()) {
        (Ok(from), Ok(to)) if from <= to => Ok([from, to]),
        _ => Err("expected the first and the last number of the subjects, FROM-TO".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_subjects_is_parsed() {
        assert_eq!(subjects("3-7"), Ok([3, 7]));
        assert_eq!(subjects("5"), Ok([5, 5]));
        for wrong in ["", "7-3", "a-b", "-1"] {
            assert!(subjects(wrong).is_err(), "{wrong}");
        }
    }
}
