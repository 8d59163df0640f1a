//! `parallax-lab train network`: trains the network that finds joints.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _};
use inputs::Shipped;
use terminal::{Globals, output};
use training::networks::Backend;
use training::networks::pose::Settings;

const HELP: &str = "\
PEOPLE is a file of `parallax-lab train network-people`. The network finds 14 joints, nose, heels and big toes as seen, the direction of the \
trunk, and the expected error of each. The ONNX file contains its card.

After every hundred steps the state of the training is in OUT.checkpoint. After Ctrl-C or a kill, \
--resume continues, and ends with the same network, bit for bit, on the same kind of machine.

--from continues the training of a network; use a lower `rate` in --settings for this. --from shipped means the network that ships. With `extras_alone = true` \
in --settings only nose, heels and big toes are learned, and everything else in the file of --from stays as it is.

The built-in training needs no other software. A build with LibTorch (--features libtorch; docs/guide/train.md has the steps) \
can be faster.

Exit codes: 0 the network is written; 2 the command line is wrong, or an interrupted training is in the way; 3 a setting is wrong; \
4 the people or the checkpoint cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train network people.bin --backend libtorch --out person.onnx";

/// Options of `train network`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// People, prepared by `train network-people`.
    #[arg(value_name = "PEOPLE", required_unless_present = "print_settings")]
    people: Option<PathBuf>,
    /// The ONNX file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    out: Option<PathBuf>,
    /// Settings of the training, as TOML; for missing keys and defaults see --print-settings.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings that would be used, as TOML, and exit.
    #[arg(long)]
    print_settings: bool,
    /// Steps, instead of those of the settings.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    steps: Option<u32>,
    /// Random seed, instead of that of the settings.
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Backend: `built-in`, or `libtorch`, if this executable was built with it.
    #[arg(long, value_name = "NAME", default_value = "built-in", value_parser = ["built-in", "libtorch"])]
    backend: String,
    /// Network of this command to start from, in place of random weights: for more steps, or your own people.
    #[arg(long, value_name = "NETWORK")]
    from: Option<PathBuf>,
    /// Continue from the checkpoint of an interrupted training; start anew if there is none.
    #[arg(long)]
    resume: bool,
    /// Print the steps as JSON, one object per line.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let settings = settings(arguments)?;
    if arguments.print_settings {
        let text = toml::to_string(&settings).or_fail(ExitKind::Run)?;
        output::line(text.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    train(arguments, &settings, globals)
}

fn train(
    arguments: &Arguments,
    settings: &Settings,
    globals: Globals,
) -> Result<ExitCode, Failure> {
    use lab::posetraining;
    use terminal::Terminal;

    let stop = failure::Stop::on_signals().or_fail(ExitKind::Run)?;
    let terminal = Terminal::without_bar(globals.quiet || arguments.json, arguments.json);
    let job = posetraining::Job {
        out: arguments.out.clone().unwrap_or_default(),
        from: arguments.from.as_deref().map(from).transpose()?,
        resume: arguments.resume,
        backend: backend(&arguments.backend)?,
    };
    let people = posetraining::read(arguments.people.as_deref().unwrap_or("".as_ref()))?;
    let passes = posetraining::train((&job, settings), &people, (&stop, &terminal))?;
    if arguments.json {
        for pass in passes {
            output::json(&pass)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The network to go on from.
fn from(file: &std::path::Path) -> Result<lab::posetraining::Earlier, Failure> {
    Ok(lab::posetraining::Earlier {
        bytes: Shipped::PoseNetwork.read(file)?.into_owned(),
        file: file.to_path_buf(),
    })
}

fn backend(name: &str) -> Result<Backend, Failure> {
    match name {
        #[cfg(feature = "libtorch")]
        "libtorch" => Ok(Backend::LibTorch),
        #[cfg(not(feature = "libtorch"))]
        "libtorch" => {
            let message = "this Parallax was built without LibTorch";
            let hint = "build it with --features libtorch: docs/guide/train.md says how";
            Err(Failure::new(ExitKind::Usage, message).with_hint(hint))
        }
        _ => Ok(Backend::BuiltIn),
    }
}

fn settings(arguments: &Arguments) -> Result<Settings, Failure> {
    let mut settings = match &arguments.settings {
        None => Settings::default(),
        Some(file) => toml::from_str(&failure::read_text(file)?).map_err(|error| {
            Failure::new(ExitKind::Config, format!("{}: {error}", file.display()))
        })?,
    };
    if let Some(steps) = arguments.steps {
        settings.steps = steps as usize;
    }
    if let Some(seed) = arguments.seed {
        settings.seed = u64::from(seed);
    }
    settings.check().or_fail(ExitKind::Config)?;
    Ok(settings)
}
