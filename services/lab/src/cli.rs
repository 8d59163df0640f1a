//! The command line: commands, global options and help texts.

use clap::{Parser, Subcommand};
use terminal::{EXIT_CODES, Globals, completions};

use crate::commands::{eval, judge, model, simulate, smooth, synth, train};

const LONG_ABOUT: &str = "\
The laboratory of Parallax: trainings, evaluations, and synthetic sequences with their truth.

`parallax` runs the rigs; its deployments use the models that are trained here.";

const EXAMPLES: &str = "\
Examples:
    parallax-lab train fmp PARSE --only 1-100 --negatives neg/ --out person.fmp   train your own model
    parallax-lab judge person.fmp PARSE --only 101-200  measure its accuracy
    parallax-lab model import parse.mat --out parse.plx convert another format's model
    parallax-lab model show pose.onnx                   explain a network by its card
    parallax-lab eval HumanEva_I --model he.txt --out out/he    repeat the paper's evaluation
    parallax-lab synth out/walk --actions walking       make synthetic pictures, with the truth
    parallax-lab simulate hosts --cameras 8 --hosts 2   predict the needs of a deployment of several machines
";

/// Trains and judges models, evaluates the method, makes synthetic sequences.
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
    /// Train a model from annotated people.
    #[command(subcommand)]
    Train(train::Command),
    /// Evaluate versions of the method on sequences whose joints are known.
    Eval(Box<eval::Arguments>),
    /// Evaluate a model on annotated people: PCP and PCK.
    Judge(judge::Arguments),
    /// Read, show and convert models.
    #[command(subcommand)]
    Model(model::Command),
    /// Make synthetic sequences of people, with the truth.
    Synth(Box<synth::Arguments>),
    /// Compare the smoothing methods, applied to a finished run, with the truth.
    Smooth(smooth::Arguments),
    /// Predict the cores, the network and the latency that a deployment needs.
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
