//! The command line: commands, global options and help texts.

use clap::{Parser, Subcommand};
use terminal::{EXIT_CODES, Globals, completions};

use crate::commands::{eval, judge, model, simulate, smooth, synth, train};

const LONG_ABOUT: &str = "\
The laboratory of Parallax: trains models, evaluates the method, and makes synthetic sequences with ground truth.

The other program, `parallax`, runs deployments. They use the models that `parallax-lab` trains.";

const EXAMPLES: &str = "\
Examples:
    parallax-lab train fmp PARSE --only 1-100 --negatives neg/ --out person.fmp   train your own model
    parallax-lab judge person.fmp PARSE --only 101-200  measure its accuracy
    parallax-lab model import parse.mat --out parse.plx convert another format's model
    parallax-lab model show pose.onnx                   explain a network by its card
    parallax-lab eval HumanEva_I --model he.txt --out out/he    repeat the paper's evaluation
    parallax-lab synth out/walk --actions walking       make synthetic pictures, with the truth
    parallax-lab simulate hosts --cameras 8 --hosts 2   predict the resources that several machines need
";

/// Trains and evaluates models, evaluates the method, and makes synthetic sequences.
#[derive(Debug, Parser)]
#[command(
    name = "parallax-lab",
    version = env!("PARALLAX_VERSION"),
    about,
    long_about = LONG_ABOUT,
    after_help = EXIT_CODES,
    after_long_help = format!("{EXAMPLES}\n{EXIT_CODES}"),
    propagate_version = true,
    max_term_width = 100
)]
pub(crate) struct Cli {
    /// Options of all commands.
    #[command(flatten)]
    pub globals: Globals,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The command.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Train a model or a network, or learn multi-view consistency.
    #[command(subcommand)]
    Train(train::Command),
    /// Evaluate versions of the method on sequences with known joints.
    Eval(Box<eval::Arguments>),
    /// Evaluate a model on annotated people: PCP and PCK.
    Judge(judge::Arguments),
    /// Convert and show models and networks.
    #[command(subcommand)]
    Model(model::Command),
    /// Make synthetic sequences of people, with ground truth.
    Synth(Box<synth::Arguments>),
    /// Compare the results of all smoothing methods on a finished run with the ground truth.
    Smooth(smooth::Arguments),
    /// Predict the processor cores, network capacity and latency of a deployment.
    #[command(subcommand)]
    Simulate(simulate::Command),
    /// Print the completion script of a shell.
    Completions(completions::Arguments),
    /// Write manual pages, one for each command.
    Man(completions::ManArguments),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
