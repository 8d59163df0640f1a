//! `parallax detect`: people in single images.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use runtime::Failure;

/// Which images, and how.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
    parallax detect photo.jpg --model parse.mat
    parallax detect folder/ --model parse.mat --threshold -0.5 --json > people.jsonl
    parallax detect *.png --model parse.mat --overlay drawn/")]
pub(crate) struct Arguments {
    /// Images, or folders of images.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// Lowest score of a detection; the model's own by default.
    #[arg(long, value_name = "SCORE", allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Largest share of a better detection's box that a worse one may cover.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3)]
    overlap: f64,
    /// Most detections of an image.
    #[arg(long, value_name = "N", default_value_t = 100)]
    max: usize,
    /// Print one line of JSON per image.
    #[arg(long)]
    json: bool,
    /// Draw the detections into this folder.
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Joints: parse14, umpm15 or humaneva20.
    #[arg(long, value_name = "NAME", default_value = "parse14")]
    joints: String,
}

/// Detects.
pub(crate) fn run(_arguments: &Arguments) -> Result<ExitCode, Failure> {
    Ok(ExitCode::SUCCESS)
}
