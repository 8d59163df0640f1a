//! `parallax-lab train consistency`: learns the consistency between several views of a person, from sequences with ground truth.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::consistency::{Done, Job, Learning, Sequences};
use lab::evaluation::FilmSettings;
use multiview::learned::Learned;

use crate::commands::eval::size;
use crate::commands::pool;
use terminal::{Globals, Terminal, output};

const HELP: &str = "\
SEQUENCE is a sequence for `parallax-lab eval`: a folder of HumanEva-I, of UMPM or of `parallax-lab synth`, or a description file. \
Each view is solved alone. From the parts near the truth, the command learns which types occur together in \
two views. The tables depend on the angle between the cameras as seen from the person. With --rig NAME, there are also tables for each pair of \
cameras of that rig, by camera name. The threshold of each part (tau) is its median error. The joints are a linear \
map of the parts, fitted by least squares. Finally, alpha, the cap on distances and beta are chosen on \
held-out subjects, for the largest area under the PCP3D curve.

Use the file with the model that it was learned with: `consistency = \"person.consistency\"` in the [paper] section \
of a deployment, or --consistency of `eval`. For its format, see `learned::Learned` in `cargo doc -p multiview`.

--json prints one object: the weights, all weights that were tried with their scores, tau, the score of the tables on held-out \
people for each number of bins, and the error of the joints with and without the map.

Exit codes: 0 done; 2 the command line is wrong; 4 a sequence or a model cannot be used, or nothing could be learned; \
5 a calibration cannot be used; 130 interrupted. If weights were being tried, OUT then contains the tables with the default weights.

Examples:
    parallax-lab synth out/ring --rig ring:6 --subjects 1-8 --actions walking,boxing,gestures --frames 6 --rate 1
    parallax-lab train consistency out/ring --scale 0.5 --out person.consistency
    parallax-lab train consistency HumanEva_I --model he.txt --rig humaneva --hold-out S3 --out he.consistency";

/// Options of `train consistency`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Sequences to learn from; see below.
    #[arg(required = true, value_name = "SEQUENCE")]
    sequences: Vec<PathBuf>,
    /// Model file. If not given, the shipped person model.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// File to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Held-out subjects, separated by commas. The weights are chosen on them. If not given, the last quarter of the subjects.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    hold_out: Vec<String>,
    /// Maximum number of instants of the held-out subjects on which weights are tried. The instants are evenly spaced.
    #[arg(long, value_name = "N", default_value_t = 48)]
    tries: usize,
    /// Also learn tables by camera name, for the rig with this name. All sequences must be from one rig.
    #[arg(long, value_name = "NAME")]
    rig: Option<String>,
    /// Do not learn the map from parts to joints.
    #[arg(long)]
    no_joints: bool,
    /// Size of the frames.
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with = "scale")]
    size: Option<[u32; 2]>,
    /// Size of the frames as a share of the footage's size.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Do not rotate the frames upright.
    #[arg(long)]
    no_upright: bool,
    /// Use the first frame and every n-th frame after it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Maximum number of frames per sequence.
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Number of threads, which does not affect the file. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let sequences = Sequences::read(
        &arguments.sequences,
        &arguments.hold_out,
        (arguments.every, arguments.frames),
        arguments.rig.as_deref(),
    )?;
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let bytes = inputs::model_bytes(arguments.model.as_deref())?;
    let pool = pool(arguments.threads, "train")?;
    let job = job(
        arguments,
        format!("{:016x}", formats::checksum::fnv1a(&bytes)),
    );
    let terminal = Terminal::without_bar(globals.quiet, false);
    let learning = Learning::new(&job, &terminal, model, stop);
    let save = |learned: &Learned| {
        let text = learned.write().or_fail(ExitKind::Run)?;
        let failure = |error: std::io::Error| failure::in_file(&arguments.out, &error);
        files::replace(&arguments.out, text.as_bytes()).map_err(failure)
    };
    let done = pool.install(|| learning.run(&sequences.train, &sequences.held_out, &save))?;
    print(arguments, globals, &done)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the settings of the training.
fn job(arguments: &Arguments, fingerprint: String) -> Job {
    Job {
        tries: arguments.tries,
        rig: arguments.rig.clone(),
        with_joints: !arguments.no_joints,
        film: FilmSettings {
            size: arguments.size,
            scale: arguments.scale,
            upright: !arguments.no_upright,
        },
        fingerprint,
    }
}

/// Prints the summary.
fn print(arguments: &Arguments, globals: Globals, done: &Done) -> Result<(), Failure> {
    if arguments.json {
        output::json(&done.json(&arguments.out))
    } else if globals.quiet {
        Ok(())
    } else {
        output::line(done.text(&arguments.out))
    }
}
