//! Evaluation of the keypoints of a network on sequences.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{Claim, ExitKind, Failure, OrFail as _, Stop};
use inputs::library::Library;
use lab::eval::as_run::{AsRun, OpenView};
use lab::eval::evidence::{EvidenceJob, EvidenceRow, evidence_text};
use lab::evaluation::{FilmSettings, Stress};
use posenetwork::{Detector, PoseNetwork};
use statistics::score::Bootstrap;
use terminal::{Globals, Terminal, output};

use super::Arguments;

/// Options of the evaluation of a network.
#[derive(Debug, Args)]
pub(super) struct Options {
    /// Evaluate the keypoints of this network (ONNX) instead of the filters; "shipped" for the shipped network.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["model", "versions", "paper", "consistency", "sigma", "network", "oracle", "resume", "only", "without"]
    )]
    pub(super) network_evidence: Option<PathBuf>,
    /// Card of the network. If not given, the .toml file of the same name beside the network, or the network's entry `parallax.card`.
    #[arg(long, value_name = "FILE", requires = "network_evidence")]
    card: Option<PathBuf>,
    /// Detector (ONNX) that finds the boxes of people. If not given, the shipped detector.
    #[arg(long, value_name = "FILE", requires = "network_evidence")]
    pub(super) detector: Option<PathBuf>,
    /// Card of the detector. If not given, the .toml file of the same name beside the detector, or the detector's entry `parallax.card`.
    #[arg(long, value_name = "FILE", requires = "detector")]
    detector_card: Option<PathBuf>,
    /// Disturbances to add, separated by commas: clean (none), covered:N (half of the person in N views), views:N (only N views),
    /// turned:DEGREES (one camera is rotated), bystander, exchanged (left and right in one view); "all" for the whole set. Only with
    /// --network-evidence.
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "clean",
        requires = "network_evidence"
    )]
    stress: Vec<String>,
}

impl Options {
    fn stress(&self) -> Result<Vec<Stress>, Failure> {
        if self.stress == ["all"] {
            return Ok(Stress::ALL.to_vec());
        }
        let each = self.stress.iter().map(|stress| stress.parse::<Stress>());
        let all: Result<Vec<Stress>, _> = each.collect();
        all.map_err(|error| Failure::new(ExitKind::Usage, format!("--stress: {error}")))
    }
}

/// Files of the networks on the command line.
struct Files<'a> {
    file: &'a Path,
    options: &'a Options,
}

impl OpenView for Files<'_> {
    fn network(&self) -> Result<PoseNetwork, Failure> {
        let network = (self.file, self.options.card.as_deref());
        inputs::open_network(network, &Library::BuiltIn)?.fitted()
    }

    fn detector(&self) -> Result<Detector, Failure> {
        let detector = self.options.detector.as_deref();
        let card = self.options.detector_card.as_deref();
        inputs::detector::open(detector.unwrap_or(Path::new(deployment::SHIPPED)), card)
    }
}

/// Runs the evaluation.
pub(super) fn run(
    arguments: &Arguments,
    file: &Path,
    globals: Globals,
    stop: Stop,
) -> Result<ExitCode, Failure> {
    let options = &arguments.evidence;
    let stress = options.stress()?;
    let sequences = super::sequences(arguments)?;
    let files = Files { file, options };
    let (network, detector) = (files.network()?, files.detector()?);
    let as_run = AsRun {
        open: &files,
        model: inputs::model_or_shipped(None)?,
    };
    let _claim = Claim::take(&arguments.out, "eval")?;
    let job = EvidenceJob {
        network: &network,
        detector: &detector,
        as_run: &as_run,
        stress: &stress,
        film: FilmSettings {
            size: arguments.size,
            scale: arguments.scale,
            upright: !arguments.no_upright,
        },
        bootstrap: Bootstrap {
            block: arguments.block,
            ..Bootstrap::default()
        },
        stop,
    };
    let terminal = Terminal::with_bar(globals.quiet, false, super::BAR);
    let rows = job.run(&sequences, &terminal)?;
    write(&arguments.out, &rows)?;
    if arguments.json {
        output::json(&rows)?;
    } else {
        output::line(evidence_text(&rows).trim_end())?;
    }
    failure::require_results(
        rows.iter().any(|row| row.n_frames > 0),
        "no frame was evaluated: the input has no frames, or --every excludes all of them",
    )
}

fn write(out: &Path, rows: &[EvidenceRow]) -> Result<(), Failure> {
    let json = serde_json::to_vec_pretty(rows).or_fail(ExitKind::Run)?;
    for (name, bytes) in [
        ("evidence.json", json),
        ("evidence.txt", evidence_text(rows).into_bytes()),
    ] {
        let path = out.join(name);
        files::replace(&path, &bytes)
            .map_err(|error| Failure::new(ExitKind::Run, format!("{}: {error}", path.display())))?;
    }
    Ok(())
}
