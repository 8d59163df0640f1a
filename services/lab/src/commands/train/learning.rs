//! Options for training networks that find people or joints.

use std::path::{Path, PathBuf};

use crate::commands::read_settings;
use clap::Args;
use failure::{ExitKind, Failure, OrFail as _};
use serde::{Serialize, de::DeserializeOwned};
use terminal::output;
use training::networks::Backend;

/// Options for the output file and the training.
#[derive(Debug, Args)]
pub(super) struct Learning {
    /// ONNX file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    pub(super) out: Option<PathBuf>,
    /// Settings of the training, as TOML; --print-settings shows the keys and their defaults.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings of the training as TOML, and exit.
    #[arg(long)]
    pub(super) print_settings: bool,
    /// Number of steps. It overrides the number in the settings.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub(super) steps: Option<u32>,
    /// Random seed. It overrides the seed in the settings.
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u32>,
    /// Library for the computation: `built-in`, or `libtorch` if this executable was built with it.
    #[arg(long, value_name = "NAME", default_value = "built-in", value_parser = ["built-in", "libtorch"])]
    backend: String,
    /// Continue from the checkpoint of an interrupted training. If there is no checkpoint, start from the beginning.
    #[arg(long)]
    pub(super) resume: bool,
    /// Print the steps as JSON, one object per line.
    #[arg(long)]
    pub(super) json: bool,
}

impl Learning {
    /// Reads the settings file. Returns the defaults if no file is given.
    pub(super) fn read<T: DeserializeOwned + Default>(&self) -> Result<T, Failure> {
        read_settings(self.settings.as_deref())
    }

    /// Prints settings.
    pub(super) fn print(settings: &impl Serialize) -> Result<(), Failure> {
        let text = toml::to_string(settings).or_fail(ExitKind::Run)?;
        output::line(text.trim_end())
    }

    /// Returns the job, without a network to start from.
    pub(super) fn job(&self) -> Result<lab::posetraining::Job, Failure> {
        Ok(lab::posetraining::Job {
            out: self.out.clone().unwrap_or_default(),
            from: None,
            resume: self.resume,
            backend: backend(&self.backend)?,
        })
    }

    /// Prints passes if JSON was requested.
    pub(super) fn report(&self, passes: &[impl Serialize]) -> Result<(), Failure> {
        if self.json {
            for pass in passes {
                output::json(pass)?;
            }
        }
        Ok(())
    }
}

/// Returns the file name; clap guarantees that it is given.
pub(super) fn named(file: Option<&Path>) -> &Path {
    file.unwrap_or(Path::new(""))
}

fn backend(name: &str) -> Result<Backend, Failure> {
    match name {
        #[cfg(feature = "libtorch")]
        "libtorch" => Ok(Backend::LibTorch),
        #[cfg(not(feature = "libtorch"))]
        "libtorch" => {
            let message = "this executable was built without LibTorch";
            let hint = "build with --features libtorch; see docs/guide/train.md";
            Err(Failure::new(ExitKind::Usage, message).with_hint(hint))
        }
        _ => Ok(Backend::BuiltIn),
    }
}
