//! Options of the trainings of networks that find something.

use std::path::{Path, PathBuf};

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _};
use serde::{Serialize, de::DeserializeOwned};
use terminal::output;
use training::networks::Backend;

/// Options that say which file is written, and how.
#[derive(Debug, Args)]
pub(super) struct Learning {
    /// The ONNX file to write.
    #[arg(long, value_name = "FILE", required_unless_present = "print_settings")]
    pub(super) out: Option<PathBuf>,
    /// Settings of the training, as TOML; for missing keys and defaults see --print-settings.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Print the settings that would be used, as TOML, and exit.
    #[arg(long)]
    pub(super) print_settings: bool,
    /// Number of steps, instead of that of the settings.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub(super) steps: Option<u32>,
    /// Random seed, instead of that of the settings.
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u32>,
    /// The library that computes: `built-in`, or `libtorch`, if this executable was built with it.
    #[arg(long, value_name = "NAME", default_value = "built-in", value_parser = ["built-in", "libtorch"])]
    backend: String,
    /// Continue from the checkpoint of an interrupted training; start anew if there is none.
    #[arg(long)]
    pub(super) resume: bool,
    /// Print the steps as JSON, one object per line.
    #[arg(long)]
    pub(super) json: bool,
}

impl Learning {
    /// The settings of the file, or the defaults.
    pub(super) fn read<T: DeserializeOwned + Default>(&self) -> Result<T, Failure> {
        let Some(file) = &self.settings else {
            return Ok(T::default());
        };
        toml::from_str(&failure::read_text(file)?)
            .map_err(|error| Failure::new(ExitKind::Config, format!("{}: {error}", file.display())))
    }

    /// Prints settings.
    pub(super) fn print(settings: &impl Serialize) -> Result<(), Failure> {
        let text = toml::to_string(settings).or_fail(ExitKind::Run)?;
        output::line(text.trim_end())
    }

    /// The job without a network to go on from.
    pub(super) fn job(&self) -> Result<lab::posetraining::Job, Failure> {
        Ok(lab::posetraining::Job {
            out: self.out.clone().unwrap_or_default(),
            from: None,
            resume: self.resume,
            backend: backend(&self.backend)?,
        })
    }

    /// Prints passes, where JSON is wanted.
    pub(super) fn report(&self, passes: &[impl Serialize]) -> Result<(), Failure> {
        if self.json {
            for pass in passes {
                output::json(pass)?;
            }
        }
        Ok(())
    }
}

/// The named file; clap has made sure that there is one.
pub(super) fn named(file: Option<&Path>) -> &Path {
    file.unwrap_or(Path::new(""))
}

fn backend(name: &str) -> Result<Backend, Failure> {
    match name {
        #[cfg(feature = "libtorch")]
        "libtorch" => Ok(Backend::LibTorch),
        #[cfg(not(feature = "libtorch"))]
        "libtorch" => {
            let message = "this Parallax was built without LibTorch";
            let hint = "build it with --features libtorch: docs/guide/train.md says how";
            Err(Failure::new(ExitKind::Usage, message).with_hint(hint))
        }
        _ => Ok(Backend::BuiltIn),
    }
}
