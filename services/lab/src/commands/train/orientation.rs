//! `parallax-lab train orientation`: trains the network that sees in which direction a person faces.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::orientation::{Job, Report};
use lab::quality::Scenes;
use serde_json::json;
use viewquality::orientation::Settings;

use super::subjects;
use crate::commands::pool;
use terminal::{Globals, Terminal, output};

const HELP: &str = "\
Exchanging left and right in all views does not change the energy. To tell left from right, Parallax must know whether a view shows the \
person from the front or from behind. The network learns this from one or both of two sources. DATASETs are annotated \
people as for `parallax-lab train fmp`, with left and right as sides of the body (LSP; not PARSE). \
Synthetic scenes (--scenes N) are searched as in the pipeline.

--judge and --judge-scenes select people and scenes for the evaluation of the network. They are left out of the training.

The network is the same, bit for bit, on any number of threads, on machines of the same kind.

Exit codes: 0 the network is written; 2 the command line is wrong; 4 a data set cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train orientation lsp --judge 1-100 --scenes 200 --judge-scenes 20 --out person.orientation";

/// Options of `train orientation`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Annotated people: folders or files, as for `train fmp`.
    #[arg(value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// People of a data set to use. If not given, all are used.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    only: Vec<String>,
    /// People of a data set for the evaluation. These people are left out of the training.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    judge: Vec<String>,
    /// Number of synthetic scenes. Each scene gives several pictures from every camera.
    #[arg(long, value_name = "N", default_value_t = 0)]
    scenes: u32,
    /// First and last number of the synthetic people in the scenes.
    #[arg(long, value_name = "FROM-TO", default_value = "1-100", value_parser = subjects)]
    subjects: [u64; 2],
    /// Number of synthetic scenes for the evaluation.
    #[arg(long, value_name = "N", default_value_t = 0)]
    judge_scenes: u32,
    /// First and last number of the synthetic people in the scenes for the evaluation.
    #[arg(long, value_name = "FROM-TO", default_value = "901-920", value_parser = subjects)]
    judge_subjects: [u64; 2],
    /// Number of frames per camera in a scene. The frames are a few seconds apart.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=100))]
    frames: u16,
    /// Folder of photographs without people. They replace the room as the background of every third scene.
    #[arg(long, value_name = "DIR")]
    backdrop: Option<PathBuf>,
    /// Number of training passes over all people.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    passes: Option<u16>,
    /// Random seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Single-view model. If not given, the shipped person model.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// File to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Number of threads. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let pool = pool(arguments.threads, "train")?;
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let defaults = Settings::default();
    let scenes = |n: u32, subjects: [u64; 2], seed: u64| Scenes {
        n,
        subjects,
        frames: arguments.frames,
        company: 0,
        backdrop: arguments.backdrop.clone(),
        seed,
    };
    let job = Job {
        datasets: arguments.datasets.clone(),
        only: arguments.only.clone(),
        judge: arguments.judge.clone(),
        scenes: scenes(arguments.scenes, arguments.subjects, arguments.seed),
        judge_scenes: scenes(
            arguments.judge_scenes,
            arguments.judge_subjects,
            arguments.seed + 1,
        ),
        settings: Settings {
            passes: arguments.passes.map_or(defaults.passes, usize::from),
            seed: arguments.seed,
            ..defaults
        },
    };
    let terminal = Terminal::without_bar(globals.quiet, arguments.json);
    let out = &arguments.out;
    let train = || lab::orientation::train(&job, out, &model, (stop, &terminal));
    let report = pool.install(train)?;
    if arguments.json {
        output::json(&json(&report))?;
    } else if !globals.quiet {
        output::line(text(&report))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn json(report: &Report) -> serde_json::Value {
    let judged = report.judged.iter().map(|judged| {
        json!({
            "on": judged.on,
            "n": judged.n,
            "right": judged.right,
            "interval": judged.interval,
            "surprise_nats": judged.surprise,
        })
    });
    json!({
        "event": "summary",
        "photographs": report.n_photographs,
        "behind": report.n_behind,
        "rendered": report.n_rendered,
        "judged": judged.collect::<Vec<_>>(),
    })
}

fn text(report: &Report) -> String {
    let mut lines = vec![format!(
        "trained on {} photographs ({} from behind) and {} pictures of scenes",
        report.n_photographs, report.n_behind, report.n_rendered
    )];
    lines.extend(report.judged.iter().map(|judged| {
        let [low, high] = judged.interval.map(|interval| 100.0 * interval);
        format!(
            "{}: correct for {:.1} % of {} people ({low:.1} to {high:.1}), surprise {:.3} nats (0.693: no information)",
            judged.on,
            100.0 * judged.right,
            judged.n,
            judged.surprise
        )
    }));
    lines.join("\n")
}
