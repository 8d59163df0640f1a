//! `parallax-lab model`: converts, shows and evaluates models.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Subcommand;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::{Model, Springs};
use inputs::Shipped;
use serde_json::{Value, json};
use terminal::output;

use super::network;

/// Help on the output of `show` for networks.
const NETWORKS: &str = "\
For a network (.onnx), the command prints the inputs and outputs, and what its card says about them: preparation, codec, keypoints, \
the resulting joints, licence. For a detector of people, it prints the rule for boxes; with --image also the boxes it finds. If a network \
does not fit its card, the command prints the differences and exits with code 4. Without a card, it names the closest \
card in configs/networks and configs/detectors. docs/networks.md describes the cards.

Examples:
    parallax-lab model show person.fmp
    parallax-lab model show pose.onnx --card configs/networks/rtmpose-coco17.toml
    parallax-lab model show pose.onnx --image person.jpg --box 120,40,300,460 --out seen.png
    parallax-lab model show boxes.onnx --card configs/detectors/yolox.toml --image people.jpg --out boxes.png";

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Convert a model (Yang & Ramanan's .mat, or the authors' .txt) to Parallax's own format.
    Import {
        /// The model to convert.
        file: PathBuf,
        /// The file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Print or draw the structure of a model, or describe a network that finds keypoints or people (.onnx).
    #[command(after_help = NETWORKS)]
    Show {
        /// Model file or network.
        file: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
        /// Draw the model into this HTML file instead: the filters of every part and type, the tree with its springs,
        /// and the biases.
        #[arg(long, value_name = "FILE", conflicts_with = "json")]
        html: Option<PathBuf>,
        /// Options for networks.
        #[command(flatten)]
        network: network::Arguments,
    },
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Import { file, out } => import(file, out),
        Command::Show {
            file,
            html: Some(html),
            ..
        } => draw(file, html),
        Command::Show {
            file,
            json,
            network,
            ..
        } => {
            let status = if network.is_given() || is_network(file) {
                network::show(file, *json, network)?
            } else {
                show(file, *json)?
            };
            if !json && Shipped::of_file(file).is_some() {
                output::line(format_args!("  {}", Shipped::TERMS))?;
            }
            Ok(status)
        }
    }
}

/// Returns true if the file name has the extension of a network.
fn is_network(file: &Path) -> bool {
    let ending = file.extension();
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case("onnx"))
}

fn import(file: &Path, out: &Path) -> Result<ExitCode, Failure> {
    let model = inputs::model(file)?;
    fmp::files::write(out, &model).or_fail(ExitKind::Input)?;
    output::message(format_args!("wrote {}", out.display()));
    Ok(ExitCode::SUCCESS)
}

fn draw(file: &Path, html: &Path) -> Result<ExitCode, Failure> {
    let model = inputs::model(file)?;
    let page = lab::model_page::html(&model);
    files::replace(html, page.as_bytes()).map_err(|error| failure::in_file(html, &error))?;
    output::message(format_args!("wrote {}", html.display()));
    Ok(ExitCode::SUCCESS)
}

fn show(file: &Path, as_json: bool) -> Result<ExitCode, Failure> {
    let model = inputs::model(file)?;
    if as_json {
        output::json(&description(file, &model))?;
        return Ok(ExitCode::SUCCESS);
    }
    let spec = model.spec();
    let [rows, cols] = model.max_filter();
    output::line(format_args!("{}: {}", file.display(), spec.name))?;
    output::line(format_args!(
        "  {} parts, {} filters of up to {rows}x{cols} cells of {} px, {} levels per octave",
        model.n_parts(),
        model.n_filters(),
        spec.cell_px,
        spec.interval
    ))?;
    output::line(format_args!(
        "  root bias {:.4}, trained threshold {:.4}, mirror {}",
        spec.root_bias,
        spec.threshold,
        if spec.mirror.is_some() {
            "known"
        } else {
            "unknown"
        }
    ))?;
    for (part, it) in spec.parts.iter().enumerate() {
        let parent = it.edge.as_ref().map_or("root".to_owned(), |edge| {
            format!("parent {}", edge.parent + 1)
        });
        let n_types = model.n_types(part);
        output::line(format_args!(
            "  {:>3} {:<18} {n_types} types, {parent}",
            part + 1,
            it.name
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the structure of a model as JSON. Parts and parents are counted from 1, as in the published tables.
fn description(file: &Path, model: &Model) -> Value {
    let spec = model.spec();
    let parts: Vec<Value> = spec
        .parts
        .iter()
        .map(|part| {
            json!({
                "name": part.name,
                "types": part.filter_of_type.len(),
                "parent": part.edge.as_ref().map(|edge| edge.parent + 1),
                "springs": part.edge.as_ref().map(|edge| match edge.springs {
                    Springs::PerChildType(_) => "per child type",
                    Springs::PerTypePair(_) => "per pair of types",
                }),
            })
        })
        .collect();
    json!({
        "schema_version": 1,
        "file": file,
        "name": spec.name,
        "parts": parts,
        "filters": model.n_filters(),
        "max_filter_cells": model.max_filter(),
        "cell_px": spec.cell_px,
        "interval": spec.interval,
        "root_bias": spec.root_bias,
        "threshold": spec.threshold,
        "mirror": spec.mirror.as_ref().map(|mirror| mirror.iter().map(|part| part + 1).collect::<Vec<_>>()),
    })
}
