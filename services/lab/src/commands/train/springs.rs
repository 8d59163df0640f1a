//! `parallax-lab train springs`: learns the tree that holds the maps of a network together.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::Failure;
use posenetwork::springs::SpringSettings;
use serde_json::json;
use terminal::{Globals, Terminal, output};

use super::marked::Marked;

const HELP: &str = "\
A network that finds keypoints says where every joint may be, and nothing about which joints belong together. The springs do: \
where a joint lies from the next one, as a mixture of Gaussians (its types), learned by maximum likelihood from the marks alone \
and their mirror images; no picture is read. `--sides seen` suits networks whose left and right are those of the picture, and was no \
worse for others. The file is a model of 26 parts, of which 14 have evidence, the maps of the joints; it is used with any \
network (`[network] springs` of a deployment), and one ships.

DATASETs are those of `train fmp`, of people with 14 joints.

Exit codes: 0 the file is written; 2 the command line is wrong; 4 a data set cannot be used.

Example:
    parallax-lab train springs PARSE LSP --only PARSE=1-100 --sides LSP=seen --without LSP=held-out.txt --out person.springs";

/// Options of `train springs`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    people: Marked,
    /// Types of every joint.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..=64))]
    types: u16,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let chosen = arguments.people.chosen();
    let settings = SpringSettings {
        n_types: usize::from(arguments.types),
        ..SpringSettings::default()
    };
    let terminal = Terminal::without_bar(globals.quiet, arguments.json);
    let learned = lab::springs::train(&chosen, &settings, &arguments.out, &terminal)?;
    if arguments.json {
        let sets = learned.sets.iter();
        let sets = sets.map(|(name, people)| json!({ "name": name, "people": people }));
        output::json(&json!({
            "event": "summary",
            "sets": sets.collect::<Vec<_>>(),
            "parts": learned.n_parts,
            "bytes": learned.n_bytes,
        }))?;
    } else if !globals.quiet {
        let sets = learned.sets.iter();
        let sets: Vec<String> = sets
            .map(|(name, n)| format!("{n} people of {name}"))
            .collect();
        output::line(format!(
            "{}: {} parts, {} bytes, of {}",
            arguments.out.display(),
            learned.n_parts,
            learned.n_bytes,
            sets.join(" and ")
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
