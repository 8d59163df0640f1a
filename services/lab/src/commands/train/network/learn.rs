//! `parallax-lab train network`: trains the network that finds joints.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use inputs::Shipped;
use lab::posetraining::{self, Job};
use terminal::{Globals, Terminal};
use training::networks::pose::Settings;

use crate::commands::train::learning::Learning;

const HELP: &str = "\
PEOPLE are files of `parallax-lab train network-people`. The network finds 14 joints, the nose, the heels and the big toes. It also finds the direction \
of the trunk and an expected error of each joint. Left and right are sides of the picture. The ONNX file contains the network's card.

After every hundred steps, the state of the training is saved in OUT.checkpoint. After Ctrl-C or a kill, \
--resume continues from there. The resulting network is the same, bit for bit, on machines of the same kind.

--from FILE continues the training of a network; use a lower `rate` in --settings for this. --from shipped continues from the shipped network.

The built-in training needs no other software. A build with LibTorch can be faster \
(--features libtorch; see docs/guide/train.md).

Exit codes: 0 the network is written; 2 the command line is wrong, or an interrupted training is in the way; 3 a setting is wrong; \
4 the people or the checkpoint cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train network people.bin --backend libtorch --out person.onnx";

/// Options of `train network`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Files of people, prepared by `train network-people`.
    #[arg(value_name = "PEOPLE", required_unless_present = "print_settings")]
    people: Vec<PathBuf>,
    #[command(flatten)]
    learning: Learning,
    /// Network that this command has written. The training starts from it instead of from random weights. Use it to train for more steps,
    /// or to add your own people.
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
    let job = Job {
        from: arguments.from.as_deref().map(from).transpose()?,
        ..learning.job()?
    };
    let mut people = posetraining::Prepared::default();
    for file in &arguments.people {
        people.append(posetraining::read(file)?);
    }
    let passes = posetraining::train((&job, &settings), &people, (&stop, &terminal))?;
    learning.report(&passes)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the network to start from.
fn from(file: &Path) -> Result<posetraining::Earlier, Failure> {
    Ok(posetraining::Earlier {
        bytes: Shipped::PoseNetwork.read(file)?.into_owned(),
        file: file.to_path_buf(),
    })
}
