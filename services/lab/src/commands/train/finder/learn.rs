//! `parallax-lab train finder`: trains the network that finds people in whole pictures.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::finding;
use terminal::{Globals, Terminal};
use training::networks::finder::Settings;

use crate::commands::train::learning::{Learning, named};

const HELP: &str = "\
PICTURES is a file of `parallax-lab train finder-pictures`. The network finds a box around every person in a whole picture. The ONNX file \
contains its card. It can be used as `network.detector` in a deployment.

After every hundred steps, the state of the training is saved in OUT.checkpoint. After Ctrl-C or a kill, --resume continues from there. \
The resulting network is the same, bit for bit, on machines of the same kind.

Exit codes: 0 the network is written; 2 the command line is wrong, or an interrupted training is in the way; 3 a setting is wrong; \
4 the pictures or the checkpoint cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train finder pictures.bin --out person.boxes.onnx";

/// Options of `train finder`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// File of pictures, prepared by `train finder-pictures`.
    #[arg(value_name = "PICTURES", required_unless_present = "print_settings")]
    pictures: Option<PathBuf>,
    #[command(flatten)]
    learning: Learning,
    /// Network that this command has written. The training starts from it instead of from random weights. Use it to train for more steps,
    /// or to add your own pictures.
    #[arg(long, value_name = "NETWORK")]
    from: Option<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let learning = &arguments.learning;
    let mut settings: Settings = learning.read()?;
    settings.steps = learning.steps.map_or(settings.steps, |steps| steps as usize);
    settings.seed = learning.seed.map_or(settings.seed, u64::from);
    settings.check().or_fail(ExitKind::Config)?;
    if learning.print_settings {
        Learning::print(&settings)?;
        return Ok(ExitCode::SUCCESS);
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let terminal = Terminal::without_bar(globals.quiet || learning.json, learning.json);
    let pictures = finding::read(named(arguments.pictures.as_deref()))?;
    let earlier = |file: &PathBuf| -> Result<_, Failure> {
        let bytes = files::read(file, files::MODEL).map_err(|error| failure::in_file(file, &error));
        Ok(finding::Earlier {
            bytes: bytes?,
            file: file.clone(),
        })
    };
    let job = finding::Job {
        from: arguments.from.as_ref().map(earlier).transpose()?,
        ..learning.job()?
    };
    let passes = finding::train((&job, &settings), &pictures, (&stop, &terminal))?;
    learning.report(&passes)?;
    Ok(ExitCode::SUCCESS)
}
