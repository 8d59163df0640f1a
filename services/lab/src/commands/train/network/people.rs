//! `parallax-lab train network-people`: prepares the training people of the network that finds joints.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use inputs::network::NetworkFile;
use lab::posetraining::{self, People};
use lab::quality::Scenes;
use serde_json::json;
use terminal::{Globals, Terminal, output};

use crate::commands::train::marked::Marked;
use crate::commands::train::subjects;

/// The template of the progress bar.
const BAR: &str = "{elapsed_precise} {prefix} {bar:20} {pos}/{len} {msg}";

const HELP: &str = "\
The people come from two sources: DATASETs of annotated people as for `parallax-lab train fmp`, and synthetic scenes (--scenes N) with exact joints \
and directions, in which up to four other people stand or walk. For each person, the file contains a picture of 256 x 256 pixels and the joints; left and right are sides of the picture. \
The direction in which a person faces is computed from the marks, if left and right are sides of the body \
(LSP; for PARSE pass --sides PARSE=seen).

A teacher is another network with a card. Its joints replace missing marks. If a teacher clearly contradicts the sides of a person, the \
sides are swapped. Where a teacher agrees with a mark, the mean of both is learned. The nose, heels and big toes come from the first \
teacher whose card has them; for several teachers, repeat --teacher and --teacher-card.

One person in twelve is held out, to monitor the training and to learn the expected error. Use --without to leave out the people \
of a later evaluation.

Exit codes: 0 the file is written; 2 the command line is wrong; 4 a data set or the teacher cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train network-people lspet lspet_more PARSE --only PARSE=1-100 --sides PARSE=seen --without lspet=held-out.txt \\
        --teacher tinypose256.onnx --teacher-card configs/networks/pp-tinypose.toml --scenes 200 --out people.bin";

/// Options of `train network-people`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    people: Marked,
    /// Teacher: a network that finds keypoints, to add and correct the annotated joints and sides. Repeat the option for further networks.
    /// Each adds the keypoints that earlier networks do not have.
    #[arg(long, value_name = "FILE.onnx")]
    teacher: Vec<PathBuf>,
    /// Cards of the teachers, in the same order. If not given, the .toml file of the same name beside each teacher, or the teacher's
    /// entry `parallax.card`.
    #[arg(long, value_name = "FILE.toml", requires = "teacher")]
    teacher_card: Vec<PathBuf>,
    /// Number of synthetic scenes. Each scene gives several pictures from every camera.
    #[arg(long, value_name = "N", default_value_t = 0)]
    scenes: u32,
    /// First and last number of the synthetic people in the scenes.
    #[arg(long, value_name = "FROM-TO", default_value = "1-400", value_parser = subjects)]
    subjects: [u64; 2],
    /// Number of frames per camera in a scene. The frames are a few seconds apart.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=100))]
    frames: u16,
    /// Folder of photographs without people. They replace the room as the background of every third scene.
    #[arg(long, value_name = "DIR")]
    backdrop: Option<PathBuf>,
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

/// Largest number of other people in a scene who stand around, and who walk past.
const COMPANY: u64 = 2;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let of_thread = |_| -> Result<Vec<_>, Failure> {
        let each = arguments.teacher.iter().enumerate().map(|(nth, file)| {
            let card = arguments.teacher_card.get(nth).map(PathBuf::as_path);
            NetworkFile::open(file, card)?.fitted()
        });
        each.collect()
    };
    let n_threads = if arguments.teacher.is_empty() {
        0
    } else {
        rayon::current_num_threads()
    };
    let teachers: Result<Vec<_>, Failure> = (0..n_threads).map(of_thread).collect();
    let people = People {
        photographs: arguments.people.chosen(),
        teachers: teachers?,
        scenes: Scenes {
            n: arguments.scenes,
            subjects: arguments.subjects,
            frames: arguments.frames,
            company: COMPANY,
            backdrop: arguments.backdrop.clone(),
            seed: arguments.seed,
        },
    };
    let terminal = Terminal::with_bar(globals.quiet, arguments.json, BAR);
    let prepared = posetraining::prepare(&people, (&stop, &terminal))?;
    posetraining::write(&arguments.out, &prepared)?;
    if arguments.json {
        output::json(&json!({
            "event": "summary",
            "learnt": prepared.learnt.len(),
            "kept_apart": prepared.kept.len(),
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}
