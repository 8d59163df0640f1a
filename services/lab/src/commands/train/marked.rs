//! Options for annotated people, shared by several trainings.

use std::path::PathBuf;

use clap::Args;
use lab::person::Chosen;

/// Data sets, and the selection of people from them.
#[derive(Debug, Args)]
pub(super) struct Marked {
    /// Annotated people: folders or files, as for `train fmp`.
    #[arg(value_name = "DATASET", required = true)]
    datasets: Vec<PathBuf>,
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
}

impl Marked {
    /// Returns the choice of people. All values without an option are the defaults.
    pub(super) fn chosen(&self) -> Chosen {
        Chosen {
            datasets: self.datasets.clone(),
            only: self.only.clone(),
            without: self.without.clone(),
            sides: self.sides.clone(),
            ..Chosen::default()
        }
    }
}
