//! Options of `train fmp` for its data: annotated people, and images without people.

use std::path::PathBuf;

use clap::Args;
use failure::Failure;
use lab::person::{Chosen, parse_skeleton};
use training::datasets::{FaultKind, SkeletonTable};

/// Options for the training data.
#[derive(Debug, Args)]
pub(super) struct People {
    /// Annotated people: folders or files, described below.
    #[arg(value_name = "DATASET", required_unless_present = "print_settings")]
    datasets: Vec<PathBuf>,
    /// Folder of images without people. The option can be repeated.
    #[arg(long, value_name = "DIR", required_unless_present = "print_settings")]
    negatives: Vec<PathBuf>,
    /// People of a data set to train on. If not given, all are used.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    only: Vec<String>,
    /// People of a data set to leave out, for example its test set.
    #[arg(long, value_name = "[DATASET=]SELECTION")]
    without: Vec<String>,
    /// Meaning of left and right. `marked`: as in the data set. `seen`: swapped for people seen from behind.
    /// The default is `marked`.
    #[arg(long, value_name = "[DATASET=]SIDES")]
    sides: Vec<String>,
    /// Also train on copies rotated anticlockwise by these angles in degrees, for example -15,-7.5,7.5,15.
    #[arg(long, value_name = "[DATASET=]DEGREES,...", allow_hyphen_values = true)]
    rotate: Vec<String>,
    /// Do not train on mirrored images.
    #[arg(long)]
    no_mirror: bool,
    /// Parts of the model and their positions between the joints, as TOML. If not given, the 26 published parts for 14 joints.
    #[arg(long, value_name = "FILE")]
    skeleton: Option<PathBuf>,
    /// Kinds of bad labels that end the training, separated by commas, or `all`. People with other bad labels are left out.
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = fatal)]
    fatal: Vec<Fatal>,
}

/// Kinds of bad labels that end the training.
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
    kind.map(Fatal::One).ok_or_else(|| format!("expected all, or some of {known}"))
}

impl People {
    /// Returns true if the training uses mirrored images.
    pub(super) fn with_mirror(&self) -> bool {
        !self.no_mirror
    }

    /// Reads the skeleton of the model.
    pub(super) fn table(&self) -> Result<SkeletonTable, Failure> {
        match &self.skeleton {
            Some(file) => parse_skeleton(file, &failure::read_text(file)?),
            None => Ok(SkeletonTable::published()),
        }
    }

    /// Returns the data options of the training.
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
