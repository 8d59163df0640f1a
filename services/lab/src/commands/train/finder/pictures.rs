//! `parallax-lab train finder-pictures`: prepares the training pictures of the network that finds people.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::finding::{self, Sources};
use lab::quality::Scenes;
use serde_json::json;
use terminal::{Globals, Terminal, output};

use crate::commands::train::marked::Marked;
use crate::commands::train::subjects;

/// The template of the progress bar.
const BAR: &str = "{elapsed_precise} {prefix} {bar:20} {pos}/{len} {msg}";

const HELP: &str = "\
The pictures come from three sources: DATASETs of annotated people as for `parallax-lab train fmp`, with boxes around their joints; photographs \
without people (--empty DIR); and synthetic scenes of several people (--scenes N). Pictures are reduced so that the \
longer side has at most 320 pixels.

A teacher is a detector with a card. It finds the other people in the photographs of annotated people. Boxes with a high score \
count as people; the training ignores boxes with a lower score. Without a teacher, people who are not annotated count as background.

One picture in twelve is held out, to monitor the training.

Exit codes: 0 the file is written; 2 the command line is wrong; 4 a data set or the teacher cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train finder-pictures lspet lspet_more PARSE --only PARSE=1-100 --without lspet=held-out.txt \\
        --teacher yolox_nano.onnx --teacher-card configs/detectors/yolox.toml --empty INRIA/neg --scenes 300 --out pictures.bin";

/// Options of `train finder-pictures`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    people: Marked,
    /// Teacher: a detector that finds all people in the photographs.
    #[arg(long, value_name = "FILE.onnx")]
    teacher: Option<PathBuf>,
    /// Card of the teacher. If not given, the .toml file of the same name beside the teacher, or the teacher's entry `parallax.card`.
    #[arg(long, value_name = "FILE.toml", requires = "teacher")]
    teacher_card: Option<PathBuf>,
    /// Folder of photographs without people. The photographs are also used as the background of every third scene.
    #[arg(long, value_name = "DIR")]
    empty: Option<PathBuf>,
    /// Number of synthetic scenes. Each scene gives several pictures from every camera.
    #[arg(long, value_name = "N", default_value_t = 0)]
    scenes: u32,
    /// First and last number of the synthetic people in the scenes.
    #[arg(long, value_name = "FROM-TO", default_value = "1-400", value_parser = subjects)]
    subjects: [u64; 2],
    /// Number of frames per camera in a scene. The frames are a few seconds apart.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=100))]
    frames: u16,
    /// Random seed of the scenes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// File to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let card = arguments.teacher_card.as_deref();
    let open = |file: &Path| -> Result<Vec<_>, Failure> {
        let each = (0..rayon::current_num_threads()).map(|_| inputs::detector::open(file, card));
        each.collect()
    };
    let teachers = arguments.teacher.as_deref().map(open).transpose()?;
    let sources = Sources {
        photographs: arguments.people.chosen(),
        teachers: teachers.unwrap_or_default(),
        empty: arguments.empty.clone(),
        scenes: Scenes {
            n: arguments.scenes,
            subjects: arguments.subjects,
            frames: arguments.frames,
            company: scene::Settings::MOST_OTHERS,
            backdrop: arguments.empty.clone(),
            seed: arguments.seed,
        },
    };
    let terminal = Terminal::with_bar(globals.quiet, arguments.json, BAR);
    let prepared = finding::prepare(&sources, (&stop, &terminal))?;
    finding::write(&arguments.out, &prepared)?;
    if arguments.json {
        output::json(&json!({
            "event": "summary",
            "learnt": prepared.learnt.len(),
            "kept_apart": prepared.kept.len(),
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}
