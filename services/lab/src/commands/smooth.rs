//! `parallax-lab smooth`: compares smoothing methods on a finished run with the ground truth.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::Failure;
use lab::smoothed::{self, Row};
use motion::finished;
use serde_json::{Value, json};
use terminal::output;

/// Options of `parallax-lab smooth`.
#[derive(Debug, Args)]
#[command(after_help = "\
This command compares all methods of `parallax smooth` with the true joints, at instants that all of them have. It writes no files.
TRUTH is a sequence for `parallax-lab eval`: a folder of `parallax-lab synth`, or a file like configs/sequences/pose2sim-balancing.toml.
See docs/guide/smooth.md.

Exit codes: 0 done; 4 the folder or the truth cannot be read, or the truth has none of the frames or joints of the run.

--json prints one object:
    {\"compared\", \"methods\": [{\"method\", \"position_mm\", \"velocity_m_s\", \"acceleration_m_s2\", \"jitter_mm\", \"lag_ms\", \
\"filled_mm\": {\"mean\", \"interval\"}}]}

Examples:
    parallax-lab smooth out/walk/out --truth out/walk --json")]
pub(crate) struct Arguments {
    /// Folder with the results of a run.
    folder: PathBuf,
    /// Sequence with the true joints; see below.
    #[arg(long, value_name = "TRUTH")]
    truth: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let run = finished::read(&arguments.folder, None)?;
    if let [first, _, ..] = &run.people[..] {
        output::message(format_args!(
            "the run has {} people, but the truth has one: comparing person {}",
            run.people.len(),
            first.ids[0]
        ));
    }
    let settings = finished::Settings::default();
    let comparison = smoothed::against(&run, &settings, &arguments.truth)?;
    if arguments.json {
        let methods: Vec<Value> = comparison.rows.iter().map(Row::to_json).collect();
        output::json(&json!({ "compared": comparison.n_compared, "methods": methods }))?;
    } else {
        output::line(format_args!(
            "means and 95 % intervals over {} positions that every method has:\n{}",
            comparison.n_compared,
            smoothed::table(&comparison.rows)
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
