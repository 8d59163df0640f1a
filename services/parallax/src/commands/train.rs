//! `parallax train`: a model from annotated people, and what several views have in common.

mod consistency;
mod people;
mod quality;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, Subcommand};
use offline::person::{Job, Progress, Store};
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use training::Settings;

use crate::globals::Globals;
use crate::terminal::Terminal;
use launch::output;
use people::People;

/// The bar of the progress.
const BAR: &str = "{elapsed_precise} {prefix} {bar:20} {pos}/{len} images{msg}";

const HELP: &str = "\
DATASET is a folder with labels.mat (PARSE) or joints.mat (LSP), one of these files, or a file of \
JSON lines, one person each, image paths relative to the file:
    {\"image\": \"7.jpg\", \"joints\": [[31.5, 80.0], ...], \"visible\": [true, ...], \"name\": \"ann\"}
`visible` and `name` may be left out; the centre of the top-left pixel is (0, 0). Unless --skeleton \
says otherwise the joints are the 14 of PARSE and LSP: right ankle, knee, hip, left hip, knee, \
ankle, right wrist, elbow, shoulder, left shoulder, elbow, wrist, neck, top of the head.

The model knows left and right by the side of the picture. PARSE is marked so; in LSP and \
LSP-extended people who are seen from behind are marked by their own sides, which --sides LSP=seen \
undoes.

Rows of a data set count from 1. With several data sets, --only, --without, --rotate and --sides name \
the one they mean, as it was written: --only PARSE=1-100. A selection is a list of rows (1-100,150), or \
a file with a row, a range of rows or the file name of an image a line; what it names must be there.

The training is a list of steps. After each one everything it knows is in OUT.checkpoint, so that \
what is stopped by Ctrl-C, or killed, goes on with --resume from the last step that was done, and \
ends with the same model, bit for bit, as if it had not been interrupted, on any number of threads.

Kinds of bad labels, for --fatal: syntax, count, unknown, not-finite, zero-size, image, outside, \
twice, same-name. People with others are reported with file and row, and left out.

With --json, one object a line on standard output, nothing else:
    {\"event\": \"left-out\" | \"unreadable\" | \"data\" | \"resumed\" | \"step\" | \"summary\", ...}

Exit codes: 0 the model is written; 2 the command line is wrong, or an interrupted training is in \
the way; 3 a setting is wrong; 4 a data set, a fatal label, a checkpoint; 130 stopped by Ctrl-C.

Examples:
    parallax train fmp PARSE --only 1-100 --rotate -15,-7.5,7.5,15 \\
        --negatives INRIA/neg --out person.fmp
    parallax train fmp PARSE lsp/joints.mat --only PARSE=1-100 --rotate PARSE=-15,15 \\
        --sides lsp/joints.mat=seen --without lsp/joints.mat=held-out.txt \\
        --negatives INRIA/neg --judge holiday-photos --out person.fmp
    parallax train fmp --print-settings > settings.toml
    parallax model judge person.fmp PARSE --only 101-200";

/// What to train.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Train a flexible mixture of parts: the model that finds people in single views.
    Fmp(Box<Arguments>),
    /// Learn what several views of a person have in common: part types, weights, thresholds, joints.
    Consistency(Box<consistency::Arguments>),
    /// Train a network that predicts how far off every part of a single view is.
    Quality(Box<quality::network::Arguments>),
    /// Search pictures with known joints, and keep what the quality network is trained on.
    QualitySamples(Box<quality::samples::Arguments>),
}

/// What to train on, and how.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The people.
    #[command(flatten)]
    data: People,
    /// The model file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    out: Option<PathBuf>,
    /// How to train, as TOML; what it does not say has its default, see --print-settings.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings that would be used, as TOML, and end.
    #[arg(long)]
    print_settings: bool,
    /// Seed of everything random, instead of the settings' one.
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Threads; one a core if not given. The model does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Folder of images without people on which false alarms are counted at the end; the negatives
    /// themselves if not given.
    #[arg(long, value_name = "DIR")]
    judge: Option<PathBuf>,
    /// Go on from the checkpoint of an interrupted training; from the beginning if there is none.
    #[arg(long)]
    resume: bool,
    /// Print events and the summary as JSON, one object a line.
    #[arg(long)]
    json: bool,
}

/// Trains until the model is written, or it is told to stop.
pub(crate) fn run(command: Command, globals: Globals) -> Result<ExitCode, Failure> {
    let arguments = match command {
        Command::Fmp(it) => it,
        Command::Consistency(it) => return consistency::run(&it, globals),
        Command::Quality(arguments) => return quality::network::run(&arguments, globals),
        Command::QualitySamples(arguments) => return quality::samples::run(&arguments, globals),
    };
    let settings = settings(&arguments)?;
    if arguments.print_settings {
        output::line(
            toml::to_string(&settings)
                .or_fail(ExitKind::Run)?
                .trim_end(),
        )?;
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
    let threads = arguments.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|it| format!("train-{it}"))
        .build()
        .or_fail(ExitKind::Run)?;
    let worker = Arc::clone(&shared);
    let done = offline::unless_stopped(&stop, move || {
        pool.install(|| work(&arguments, &settings, &worker))
    })?;
    shared.progress.finish();
    match done {
        Some(Err(failure)) if failure.kind() != ExitKind::Interrupted => Err(failure),
        Some(Ok(code)) => Ok(code),
        _ => Err(shared.store.interrupted()),
    }
}

/// What the thread that trains shares with the one that waits for it.
struct Shared {
    store: Store,
    progress: Progress,
    quiet: bool,
}

fn settings(arguments: &Arguments) -> Result<Settings, Failure> {
    let mut settings = match &arguments.settings {
        None => Settings::default(),
        Some(file) => toml::from_str(&runtime::read_text(file)?).map_err(|error| {
            Failure::new(ExitKind::Config, format!("{}: {error}", file.display()))
        })?,
    };
    if let Some(seed) = arguments.seed {
        settings.seed = u64::from(seed);
    }
    // Without mirror images left is not the mirror image of right.
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
    let report = offline::person::train(&job, &shared.store, &shared.progress)?;
    if arguments.json {
        output::json(&report.json())?;
    } else if !shared.quiet {
        output::line(report.text())?;
    }
    Ok(ExitCode::SUCCESS)
}
