//! Options of `train fmp` that name its people, and its images without people.

use std::path::PathBuf;

use clap::Args;
use datasets::{FaultKind, SkeletonTable};
use offline::person::{Chosen, parse_skeleton};
use runtime::Failure;

/// Which people, which images without people, and what is made of them.
#[derive(Debug, Args)]
pub(super) struct People {
    /// Annotated people: folders or files, see below.
    #[arg(value_name = "DATASET", required_unless_present = "print_settings")]
    datasets: Vec<PathBuf>,
    /// Folder of images without people, all of which are used; may be given several times.
    #[arg(long, value_name = "DIR", required_unless_present = "print_settings")]
    negatives: Vec<PathBuf>,
    /// Who of a data set is trained on, everybody if not given.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    only: Vec<String>,
    /// Who of a data set is left out: a test set.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    without: Vec<String>,
    /// Whose left and right: `marked`, or `seen`, for which people who are seen from behind have them
    /// exchanged; marked if not given.
    #[arg(long, value_name = "[DATASET=]SIDES")]
    sides: Vec<String>,
    /// Train on turned copies too, degrees, anticlockwise: -15,-7.5,7.5,15.
    #[arg(long, value_name = "[DATASET=]DEGREES,...", allow_hyphen_values = true)]
    rotate: Vec<String>,
    /// Do not train on mirror images.
    #[arg(long)]
    no_mirror: bool,
    /// The parts of the model and where they lie between the joints, as TOML; the published 26 parts
    /// between 14 joints if not given.
    #[arg(long, value_name = "FILE")]
    skeleton: Option<PathBuf>,
    /// Kinds of bad labels that end the training instead of leaving the person out: a list, or `all`.
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = fatal)]
    fatal: Vec<Fatal>,
}

/// Faults that end the training.
#[derive(Debug, Clone, Copy)]
enum Fatal {
    All,
    One(FaultKind),
}

fn fatal(name: &str) -> Result<Fatal, String> {
    if name == "all" {
        return Ok(Fatal::All);
    }
    let known = FaultKind::ALL.map(FaultKind::name).join(", ");
    let kind = FaultKind::by_name(name);
    kind.map(Fatal::One)
        .ok_or_else(|| format!("expected all, or some of {known}"))
}

impl People {
    /// Whether mirror images are trained on.
    pub(super) fn with_mirror(&self) -> bool {
        !self.no_mirror
    }

    /// The skeleton that is trained.
    pub(super) fn table(&self) -> Result<SkeletonTable, Failure> {
        match &self.skeleton {
            Some(file) => parse_skeleton(file, &runtime::read_text(file)?),
            None => Ok(SkeletonTable::published()),
        }
    }

    /// The same for the training.
    pub(super) fn chosen(&self) -> Chosen {
        let mut fatal: Vec<FaultKind> = Vec::new();
        for fault in &self.fatal {
            match fault {
                Fatal::All => fatal.extend(FaultKind::ALL),
                Fatal::One(kind) => fatal.push(*kind),
            }
        }
        Chosen {
            datasets: self.datasets.clone(),
            negatives: self.negatives.clone(),
            only: self.only.clone(),
            without: self.without.clone(),
            sides: self.sides.clone(),
            rotate: self.rotate.clone(),
            with_mirror: self.with_mirror(),
            fatal,
        }
    }
}
