//! `parallax-lab train quality`: trains the network that predicts the error of every part in a single view.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use failure::{ExitKind, Failure, OrFail as _};
use training::networks::quality::network::Kind;
use training::networks::quality::settings::Settings;

use crate::commands::read_settings;
use terminal::{Globals, output};

const HELP: &str = "\
The samples come from `parallax-lab train quality-samples`. Whole groups of samples (subjects, images) are held out for \
validation. After every pass, the state of the training is saved in OUT.checkpoint, and --resume continues from there. On the CPU, the resulting \
network is the same, bit for bit, with or without interruptions. OUT.svg shows the progress of the training. The network of the best pass is \
written as ONNX, with all data that `errors` in [paper] needs: preprocessing, unit, thresholds.

VGG-16 (--network vgg16) needs samples made with --tile vgg16. It starts from torchvision's weights: --weights vgg16.safetensors (to convert \
a .pth file, use safetensors.torch.save_file).

Exit codes: 0 the network is written; 2 the command line is wrong, or an interrupted training is in the way; 3 a \
setting is wrong; 4 samples, weights or a checkpoint cannot be used; 130 stopped by Ctrl-C.

Example:
    parallax-lab train quality --samples train.samples --judge test.samples --out person.quality.onnx";

/// The architecture of the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Network {
    /// A baseline that uses only features of the search, without the picture.
    Evidence,
    /// A few separable convolutions, sampled around every part, together with the features of the search.
    Small,
    /// The network of the paper.
    Vgg16,
}

impl From<Network> for Kind {
    fn from(network: Network) -> Self {
        match network {
            Network::Evidence => Self::Evidence,
            Network::Small => Self::Small,
            Network::Vgg16 => Self::Vgg16,
        }
    }
}

/// Options of `train quality`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Files of samples for training and validation.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    samples: Vec<PathBuf>,
    /// Files of samples on which the network is tested, separately for each file. They are not used for training.
    #[arg(long, value_name = "FILE")]
    judge: Vec<PathBuf>,
    /// ONNX file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    out: Option<PathBuf>,
    /// Settings of the training, as TOML; --print-settings shows the keys and their defaults.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings of the training as TOML, and exit.
    #[arg(long)]
    print_settings: bool,
    /// Architecture of the network. It overrides the architecture in the settings.
    #[arg(long, value_enum)]
    network: Option<Network>,
    /// Random seed. It overrides the seed in the settings.
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Initial weights: torchvision's VGG-16, as a .safetensors file.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Identity stored in the file. If not given, the file's name.
    #[arg(long, value_name = "TEXT")]
    identity: Option<String>,
    /// Continue from the checkpoint of an interrupted training. If there is no checkpoint, start from the beginning.
    #[arg(long)]
    resume: bool,
    /// Print events and the summary as JSON, one object per line.
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
    use terminal::Terminal;

    let job = lab::quality::network::Job {
        samples: arguments.samples.clone(),
        judge: arguments.judge.clone(),
        out: arguments.out.clone().unwrap_or_default(),
        weights: arguments.weights.clone(),
        identity: arguments.identity.clone(),
        resume: arguments.resume,
    };
    let stop = failure::Stop::on_signals().or_fail(ExitKind::Run)?;
    let terminal = Terminal::without_bar(globals.quiet || arguments.json, arguments.json);
    lab::quality::network::train(&job, settings, &stop, &terminal)?;
    Ok(ExitCode::SUCCESS)
}

fn settings(arguments: &Arguments) -> Result<Settings, Failure> {
    let mut settings: Settings = read_settings(arguments.settings.as_deref())?;
    if let Some(network) = arguments.network {
        settings.network = network.into();
    }
    if let Some(seed) = arguments.seed {
        settings.seed = u64::from(seed);
    }
    settings.check().or_fail(ExitKind::Config)?;
    Ok(settings)
}
