//! `parallax-lab train joints`: learns the positions of joints relative to the parts of a model.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::joints::Learned;
use serde_json::json;

use super::marked::Marked;
use crate::commands::pool;
use terminal::{Globals, Terminal, output};

const HELP: &str = "\
By default, a joint is the centre of one part. This command learns every joint as a weighted sum of that part and the parts \
around it. It searches pictures of annotated people with the model, and uses the best detection that covers 30 % of the box \
around a person's joints. The map is the same for left and right, mirrored. Joints farther than a tenth of the \
person's size from their mark are ignored, because the limb was not found. Every data set has the same weight, whatever its \
number of people. Cross-validation over people chooses the number of parts and the ridge.

A DATASET has the form that `train fmp` describes, and people with 14 joints. Use the data sets of the model, with the same --only, --sides \
and --without. The file fits this model only. Pass it as `paper.joint_map` in a deployment, or as --joint-map to \
`detect`, `eval` and `judge`. The file for the shipped model is part of Parallax.

The file is the same on any number of threads.

Exit codes: 0 the file is written; 2 the command line is wrong; 4 a model or a data set cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train joints person.fmp PARSE LSP --only PARSE=1-100 --sides LSP=seen --without LSP=held-out.txt \\
        --out person.joints
    parallax-lab judge person.fmp PARSE --only 101-200 --joint-map person.joints --offsets";

/// Options of `train joints`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Model file with 26 parts; "shipped" for the shipped model.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    #[command(flatten)]
    people: Marked,
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
    let file = (!deployment::is_shipped(&arguments.model)).then_some(arguments.model.as_path());
    let model = inputs::model_or_shipped(file)?;
    lab::judged::check(&model, &arguments.model.display().to_string())?;
    let fingerprint = formats::checksum::fnv1a(&inputs::model_bytes(file)?);
    let chosen = arguments.people.chosen();
    let terminal = Terminal::without_bar(globals.quiet, arguments.json);
    let of = (&Arc::clone(&model), fingerprint);
    let train = || lab::joints::train(&chosen, &arguments.out, of, (&stop, &terminal));
    let learned = pool.install(train)?;
    if arguments.json {
        output::json(&summary(&learned))?;
    } else if !globals.quiet {
        output::line(text(&learned))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn summary(learned: &Learned) -> serde_json::Value {
    let tried = learned.tried.iter();
    let tried =
        tried.map(|(settings, errors)| json!({ "reach": settings.reach, "ridge": settings.ridge, "errors": errors }));
    json!({
        "event": "summary",
        "learned": learned.file.learned,
        "tried": tried.collect::<Vec<_>>(),
    })
}

fn text(learned: &Learned) -> String {
    let it = &learned.file.learned;
    let mut lines = vec!["reach  ridge   error on held-out people, % of their size".to_owned()];
    for (tried, errors) in &learned.tried {
        let errors: Vec<String> = errors.iter().map(|error| format!("{error:.3}")).collect();
        let is_taken = tried.reach == it.reach && tried.ridge == it.ridge;
        let mark = if is_taken { "  <- chosen" } else { "" };
        let (reach, ridge) = (tried.reach, tried.ridge);
        lines.push(format!(
            "{reach:>5} {ridge:>6}   {}{mark}",
            errors.join("  ")
        ));
    }
    for set in &it.sets {
        lines.push(format!(
            "{}: {} of {} people found; error on held-out people: {:.3} before, {:.3} after",
            set.name, set.found, set.people, set.error_before, set.error_after
        ));
    }
    lines.join("\n")
}
