//! `parallax-lab eval`: the paper's evaluation on sequences with ground truth.

mod evidence;
mod height;
mod pictures;
mod report;
mod several;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use steps::fuse;

use clap::Args;
use deployment::energy_numbers;
use deployment::paper::{Config, Consistency};
use failure::{Claim, ExitKind, Failure, OrFail as _, Stop};
use fmp::Model;
use inputs::Shipped;
use lab::eval::{Done, Fusion, Job};
use lab::evaluation::{FilmSettings, Version};
use multiview::learned::Learned;
use skeleton::JointSet;
use training::datasets::Selection;
use training::datasets::sequences::{Alignment, Sequence};
use viewquality::{Forecaster, Network, Table};

use super::judge::selection;
use crate::commands::pool;
use terminal::{Globals, Terminal};

/// The template of the progress bar.
const BAR: &str = "{elapsed_precise} {bar:30} {pos}/{len} frames, {msg}";

const HELP: &str = "\
SEQUENCE is a folder of HumanEva-I (all of it or one subject), of UMPM or of `parallax-lab synth`, a description file \
(configs/sequences/), or a set of single pictures (below). In every frame, each view is first solved alone. Then each version solves the frame.

Versions: fmp (each view alone, then triangulation); geometry (adds distances to epipolar lines); appearance (adds part types); \
adaptive (switches off parts with a large expected error). They solve pairs of views and take the mean of the results, as in the paper. \
A suffix changes this: geometry+consensus uses the poses that most views support. In geometry+all-views, all other views \
support each view at once; geometry+all-views-mean uses the mean of their terms. Without --versions, every version whose inputs are given \
is evaluated, with pairs and with all views. appearance needs tables of part types or --consistency; adaptive needs --network, --sigma or \
--oracle.

--network FILE predicts the errors of the single views, as the service `quality` does. The report then shows how accurate the predictions \
are for each part: area under the ROC curve and rank correlation. The network's thresholds apply if --paper sets no tau. \
If the network has none either, the threshold is a tenth of the person's size.

--paper FILE is a file with the keys of a deployment's [paper] section: energy, alpha, beta, compatibility, tau, facing ...

Single pictures of people with 14 joints (the folders of PARSE and LSP, or JSON lines) are evaluated as in `judge`. \
The report has PCP and PCK of the best detection in a picture and of the best detection on the person, with \
intervals. --only and --without select pictures. One run cannot mix pictures and sequences.

OUT contains report.html, report.json, report.tex, and the poses of every frame in poses/. \
--resume continues an interrupted run with the same settings and keeps the frames that are solved. --json prints the numbers of the report.

For a folder of several people in the layout of Shelf (calibration.json, detection/, gt.txt), the evaluation covers identities too: \
detections are grouped into people, who are followed and solved. PCP3D is measured as in 4D Association, with its rule for the head. --views \
selects cameras. --run RUN evaluates all people in a finished run of a folder of `parallax-lab synth`: PCP3D of each person, mean error, \
average precision at 25 to 150 mm, recall, id changes, and people found against people present. OUT then contains people.json.

--network-evidence FILE [--detector FILE] evaluates the keypoints of a network (docs/networks.md) with four methods: plain \
triangulation, triangulation that leaves out cameras, and the solution in space over the network's maps, without and with bones. \
--stress adds problems that occur in real rooms. OUT then contains evidence.txt and evidence.json.

Exit codes: 0 done; 2 the command line is wrong; 3 a setting is wrong; 4 a sequence or a model cannot be used; 5 a \
calibration cannot be used; 7 done, but the footage ended before the ground truth; 130 interrupted.

Examples:
    parallax-lab eval configs/sequences/pose2sim-balancing.toml --model parse.mat --size 272x480 --every 5 --out out/eval
    parallax-lab eval PARSE --only 101-200 --model parse.mat --out out/parse
    parallax-lab eval HumanEva_I --model he.txt --paper he.toml --sigma errors.csv --out out/humaneva --resume";

/// Options of `parallax-lab eval`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a switch of the command line"
)]
pub(crate) struct Arguments {
    /// Sequences to evaluate; see below.
    #[arg(required = true, value_name = "SEQUENCE")]
    sequences: Vec<PathBuf>,
    /// Model file. If not given, the shipped person model.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Folder for the report.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Versions to compare, separated by commas. The first version is the baseline of the comparison.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    versions: Vec<Version>,
    /// Settings for fusion: a TOML file with the keys of `[paper]`.
    #[arg(long, value_name = "FILE")]
    paper: Option<PathBuf>,
    /// Consistency file, written by `train consistency`: tables of part types, weights and thresholds; "shipped" for the shipped file. It
    /// replaces the file that the key `consistency` in --paper names.
    #[arg(long, value_name = "FILE")]
    consistency: Option<PathBuf>,
    /// Network that estimates the direction in which people face, to distinguish left from right (`train orientation`); "shipped" for the
    /// shipped network, "none" for no network.
    #[arg(long, value_name = "FILE", default_value = deployment::SHIPPED)]
    orientation: PathBuf,
    /// Table of expected errors, in the format of the paper's authors.
    #[arg(long, value_name = "FILE", conflicts_with = "oracle")]
    sigma: Option<PathBuf>,
    /// Network that predicts the expected errors (an ONNX file); "shipped" for the shipped network.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sigma", "oracle"])]
    network: Option<PathBuf>,
    /// Map from parts to joints (a file of `train joints`); "shipped" for the map of the shipped model. With "none", or for other models, a
    /// joint is the centre of its part.
    #[arg(long, value_name = "FILE", default_value = deployment::SHIPPED)]
    joint_map: PathBuf,
    /// Use the true errors as the expected errors, which switches off parts with an error above a tenth of the person's size.
    #[arg(long)]
    oracle: bool,
    /// Size of the frames.
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with = "scale")]
    size: Option<[u32; 2]>,
    /// Size of the frames as a share of the footage's size.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Do not rotate the frames upright.
    #[arg(long)]
    no_upright: bool,
    /// Maximum number of candidates per view.
    #[arg(long, value_name = "N", default_value_t = 8)]
    candidates: usize,
    /// Use the first frame and every n-th frame after it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Maximum number of frames per sequence.
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Single pictures: the people to evaluate. If not given, all are used.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    only: Option<Selection>,
    /// For data sets of single pictures: the people to leave out.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    without: Option<Selection>,
    /// The section of each sequence to use, as fractions of its length: 0.8-1 is the last fifth.
    #[arg(long, value_name = "FROM-TO", value_parser = share)]
    share: Option<[f64; 2]>,
    /// Several people: the views to use, counted from 0, separated by commas. If not given, all are used.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    views: Vec<usize>,
    /// Evaluate all people in a finished run of the sequence; DIR is the folder with the run's results.
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// For UMPM: compare every frame with the pose of the previous frame, as the released tools do.
    #[arg(long)]
    umpm_late: bool,
    /// Length of the blocks that the bootstrap draws for confidence intervals, in frames.
    #[arg(long, value_name = "N", default_value_t = 1)]
    block: usize,
    /// Number of threads, which does not affect the numbers. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Continue an interrupted run.
    #[arg(long)]
    resume: bool,
    /// Print the numbers as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    evidence: evidence::Options,
}

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("expected WIDTHxHEIGHT")?;
    let side = |text: &str| text.parse::<u32>().map_err(|error| format!("{text:?}: {error}"));
    Ok([side(width)?, side(height)?])
}

fn share(text: &str) -> Result<[f64; 2], String> {
    let (from, to) = text.split_once('-').ok_or("expected FROM-TO, such as 0.8-1")?;
    let end = |text: &str| match text.parse::<f64>() {
        Ok(end) if (0.0..=1.0).contains(&end) => Ok(end),
        _ => Err(format!("{text:?} is not a number from 0 to 1")),
    };
    let [from, to] = [end(from)?, end(to)?];
    if from < to {
        Ok([from, to])
    } else {
        Err(format!("the range from {from} to {to} is empty"))
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    if let [folder] = &arguments.sequences[..]
        && lab::several::is_one(folder)
    {
        return several::run(arguments, folder);
    }
    if let Some(finished) = &arguments.run {
        return several::run_of_scene(arguments, finished);
    }
    if are_pictures(arguments)? {
        return pictures::run(arguments, globals, &stop);
    }
    let evidence = &arguments.evidence;
    match &evidence.network_evidence {
        Some(network) => evidence::run(arguments, network, globals, stop),
        None => run_versions(arguments, globals, stop),
    }
}

/// Evaluates the versions of the method on sequences.
fn run_versions(arguments: &Arguments, globals: Globals, stop: Stop) -> Result<ExitCode, Failure> {
    let sequences = sequences(arguments)?;
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let config = config(arguments)?;
    let learned = inputs::learned(consistency_file(&config).map(PathBuf::as_path), &model)?;
    let (sigma, network) = expected(arguments, model.n_parts())?;
    let _claim = Claim::take(&arguments.out, "eval")?;
    let poses = arguments.out.join("poses");
    inputs::make_folder(&poses)?;
    let pool = pool(arguments.threads, "eval")?;
    let fusion = |sequence: &Sequence, scale: f32| {
        fusion((&config, learned.as_ref(), &model), sequence, scale)
    };
    let joints = inputs::Joints::of(&arguments.joint_map, arguments.model.as_deref())?;
    let joint_map = |set: &JointSet| joints.map(learned.as_ref(), set);
    let job = Job {
        joint_map: &joint_map,
        versions: versions(arguments, &config)?,
        settings: settings_text(arguments, &config, &joints)?,
        film: FilmSettings {
            size: arguments.size,
            scale: arguments.scale,
            upright: !arguments.no_upright,
        },
        n_candidates: arguments.candidates,
        orientation: inputs::orientation(&arguments.orientation, &model)?,
        oracle: arguments.oracle,
        resume: arguments.resume,
        fusion: &fusion,
        facing: config.facing,
        learned: learned.as_ref(),
        tau_px: match &config.tau {
            deployment::paper::Tau::File(it) => inputs::tau(&it.file, model.n_parts())?,
            it => fuse::tau_px(it),
        },
        model: Arc::clone(&model),
        sigma,
        forecaster: network.map(|network| Mutex::new(Forecaster::new(network))),
        poses,
        stop,
    };
    let terminal = Terminal::with_bar(globals.quiet, false, BAR);
    let done = pool.install(|| job.run(&sequences, &terminal))?;
    report::write(arguments, &config, &job, &done)?;
    if job.stop.is_requested() {
        let failure = Failure::new(ExitKind::Interrupted, "interrupted");
        return Err(failure.with_hint("continue with --resume"));
    }
    outcome(&done)
}

/// Reads the table of expected errors and the network that predicts them, if they are given.
fn expected(
    arguments: &Arguments,
    n_parts: usize,
) -> Result<(Option<Table>, Option<Network>), Failure> {
    let sigma = match &arguments.sigma {
        Some(file) => Some(inputs::quality_table(file, n_parts)?),
        None => None,
    };
    let network = match &arguments.network {
        Some(file) => Some(inputs::network(file, n_parts)?),
        None => None,
    };
    Ok((sigma, network))
}

/// Returns the fusion settings and the part-type tables for a sequence.
fn fusion(
    (config, learned, model): (&Config, Option<&Learned>, &Model),
    sequence: &Sequence,
    scale: f32,
) -> Result<Fusion, Failure> {
    let mut config = config.clone();
    if let deployment::paper::Tau::File(tau) = &config.tau {
        config.tau = deployment::paper::Tau::Given(inputs::tau(&tau.file, model.n_parts())?);
    }
    let settings = fuse::settings(&config, scale, learned);
    let cameras: Vec<&str> = sequence.views.iter().map(|view| view.camera.as_str()).collect();
    let tables = inputs::pair_tables(&config, learned, model, &cameras)?;
    Ok((settings, tables))
}

/// Returns the exit status: an error if frames were left out or no frame was evaluated.
fn outcome(done: &Done) -> Result<ExitCode, Failure> {
    match done.n_missing {
        0 => {
            let is_judged = done.sequences.iter().any(|sequence| !sequence.1.is_empty());
            failure::require_results(
                is_judged,
                "no frame was evaluated: the input has no frames, or --only and --every exclude all of them",
            )
        }
        n => {
            let message =
                format!("{n} frames were left out: the footage ended before the ground truth");
            Err(Failure::new(ExitKind::Degraded, message))
        }
    }
}

/// Returns true if single pictures are evaluated; refuses pictures and sequences in the same run.
fn are_pictures(arguments: &Arguments) -> Result<bool, Failure> {
    let n = arguments
        .sequences
        .iter()
        .filter(|sequence| lab::eval::pictures::is_one(sequence));
    let n = n.count();
    let selects = arguments.only.is_some() || arguments.without.is_some();
    let refuse = |message: &str| Err(Failure::new(ExitKind::Usage, message));
    if n == 0 && selects {
        return refuse(
            "--only and --without select single pictures, but no single pictures are given",
        );
    }
    if n > 0 && arguments.evidence.network_evidence.is_some() {
        return refuse("--network-evidence is for sequences, not for single pictures");
    }
    if n > 0 && n < arguments.sequences.len() {
        return refuse("single pictures and sequences cannot be evaluated in one run");
    }
    Ok(n > 0)
}

fn sequences(arguments: &Arguments) -> Result<Vec<Sequence>, Failure> {
    let options = training::datasets::sequences::Options {
        alignment: if arguments.umpm_late {
            Alignment::OneLate
        } else {
            Alignment::Direct
        },
        share: arguments.share,
    };
    let mut all: Vec<Sequence> = Vec::new();
    for path in &arguments.sequences {
        let read = training::datasets::sequences::read(path, &options);
        for mut sequence in read.map_err(lab::sequence_failure)? {
            sequence.thin_out(arguments.every, arguments.frames);
            if all
                .iter()
                .any(|other| other.name == sequence.name && other.dataset == sequence.dataset)
            {
                let message = format!("{} {} is given twice", sequence.dataset, sequence.name);
                return Err(Failure::new(ExitKind::Usage, message));
            }
            all.push(sequence);
        }
    }
    // Options of the filters have no meaning in the evaluation of a network.
    if arguments.evidence.network_evidence.is_none() {
        for warning in height::warnings(&all, arguments.size, arguments.scale) {
            tracing::warn!("{warning}");
        }
    }
    Ok(all)
}

fn config(arguments: &Arguments) -> Result<Config, Failure> {
    let mut config = paper_section(arguments.paper.as_deref())?;
    config.candidates = arguments.candidates;
    if let Some(file) = &arguments.consistency {
        config.consistency = Some(Consistency::File(file.clone()));
    }
    let needs_file =
        config.tau == deployment::paper::Tau::Named(deployment::paper::TauName::Learned);
    if needs_file && config.consistency.is_none() {
        let message = "`tau = \"learned\"` needs `consistency`, or --consistency";
        return Err(Failure::new(ExitKind::Config, message));
    }
    Ok(config)
}

fn consistency_file(config: &Config) -> Option<&PathBuf> {
    config.consistency.as_ref().map(Consistency::file)
}

/// Reads the `[paper]` settings from a file; returns the defaults if there is no file.
fn paper_section(file: Option<&Path>) -> Result<Config, Failure> {
    let Some(file) = file else {
        return Ok(Config::default());
    };
    let text = failure::read_text(file)?;
    let mut config: Config = toml::from_str(&text).map_err(|error| {
        let message = format!("{}: {error}", file.display());
        Failure::new(ExitKind::Config, message)
    })?;
    energy_numbers(&config)
        .map_err(|error| error.at(file.display().to_string()))
        .or_fail(ExitKind::Config)?;
    let folder = file.parent().map_or_else(PathBuf::new, PathBuf::from);
    config.resolve(&folder);
    Ok(config)
}

/// Returns the versions to compare: the requested versions, or all versions for which inputs are given.
fn versions(arguments: &Arguments, config: &Config) -> Result<Vec<Version>, Failure> {
    let expects = arguments.sigma.is_some() || arguments.network.is_some() || arguments.oracle;
    if let [_, ..] = arguments.versions[..] {
        let adaptive = |version: &Version| version.terms == lab::evaluation::Terms::Adaptive;
        if !expects && arguments.versions.iter().any(adaptive) {
            let message = "adaptive selection needs expected errors: --network FILE, --sigma FILE or --oracle";
            return Err(Failure::new(ExitKind::Usage, message));
        }
        return Ok(arguments.versions.clone());
    }
    let mut names = vec!["geometry"];
    if !config.compatibility.is_empty() || config.consistency.is_some() {
        names.push("appearance");
    }
    if expects {
        names.push("adaptive");
    }
    let each = ["", "+all-views"].into_iter();
    let each = each.flat_map(|suffix| names.iter().map(move |name| format!("{name}{suffix}")));
    let mut versions = vec![Version::SINGLE];
    for name in each {
        versions.push(name.parse().or_fail(ExitKind::Run)?);
    }
    Ok(versions)
}

/// Returns a text with all settings that the poses depend on, except the sequence and its frames.
fn settings_text(
    arguments: &Arguments,
    config: &Config,
    joints: &inputs::Joints,
) -> Result<String, Failure> {
    let digest = |file: &PathBuf| {
        let bytes =
            files::read(file, files::MODEL).map_err(|error| failure::in_file(file, &error))?;
        Ok::<_, Failure>(formats::checksum::fnv1a(&bytes))
    };
    let of = |kind: Shipped, file: &PathBuf| {
        Ok::<_, Failure>(formats::checksum::fnv1a(&kind.read(file)?))
    };
    let model = formats::checksum::fnv1a(&inputs::model_bytes(arguments.model.as_deref())?);
    let sigma = arguments.sigma.as_ref().map(digest).transpose()?;
    let network = arguments
        .network
        .as_ref()
        .map(|network| of(Shipped::Network, network))
        .transpose()?;
    let network = network.map_or_else(String::new, |network| format!("network {network:016x}, "));
    let orientation = if deployment::is_none(&arguments.orientation) {
        String::new()
    } else {
        let file = of(Shipped::Orientation, &arguments.orientation)?;
        format!("orientation {file:016x}, ")
    };
    let joints = joints.fingerprint();
    let mut tables = Vec::new();
    let files = config.compatibility.iter().flat_map(|table| &table.files);
    for file in files {
        tables.push(digest(file)?);
    }
    if let Some(file) = consistency_file(config) {
        tables.push(of(Shipped::Consistency, file)?);
    }
    let fuse = toml::to_string(config).or_fail(ExitKind::Run)?;
    let (size, scale) = (arguments.size, arguments.scale);
    let (upright, n, oracle) = (
        !arguments.no_upright,
        arguments.candidates,
        arguments.oracle,
    );
    Ok(format!(
        "{network}{orientation}joints {joints}, model {model:016x}, sigma {sigma:x?}, oracle {oracle}, tables {tables:x?}, size {size:?}, \
         scale {scale}, upright {upright}, candidates {n}\n{fuse}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_fractions_are_checked() {
        assert_eq!(size("272x480"), Ok([272, 480]));
        assert!(size("272").is_err() && size("ax2").is_err());
        assert_eq!(share("0.8-1"), Ok([0.8, 1.0]));
        for text in ["0.8", "1-0.8", "0.5-0.5", "0-2", "nan-1"] {
            assert!(share(text).is_err(), "{text}");
        }
    }
}
