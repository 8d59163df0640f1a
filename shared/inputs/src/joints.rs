//! Positions of joints relative to the parts of a model: from a file that the user names, or from the file that ships with the model.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deployment::{is_none, is_shipped};
use failure::{ExitKind, Failure, in_file, no_text};
use multiview::learned::{JointFile, Learned};
use skeleton::{JointMap, JointSet};

use super::model_bytes;
use crate::shipped::Shipped;

/// Positions of joints relative to the parts.
#[derive(Debug, Clone)]
pub struct Joints {
    file: Option<JointFile>,
    from: PathBuf,
}

impl Joints {
    /// Chooses the joints of a model.
    ///
    /// * `file`: file of joints. `shipped` means the shipped file, which is used only for the model that it was trained with. `none` means
    ///   that each joint is the centre of its part.
    /// * `model`: file of the model; `None` for the model that ships.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read, or if the named file was trained with a different model.
    pub fn of(file: &Path, model: Option<&Path>) -> Result<Self, Failure> {
        let chosen = |joint_file| Self {
            file: joint_file,
            from: file.to_owned(),
        };
        if is_none(file) {
            return Ok(chosen(None));
        }
        let fingerprint = format!("{:016x}", formats::checksum::fnv1a(&model_bytes(model)?));
        let read = read(file)?;
        if read.model == fingerprint {
            return Ok(chosen(Some(read)));
        }
        if is_shipped(file) {
            return Ok(chosen(None));
        }
        let message = format!(
            "{} was learned with the model {}, but the current model is {fingerprint}",
            file.display(),
            read.model
        );
        let failure = Failure::new(ExitKind::Input, message);
        Err(failure.with_hint(
            "`parallax-lab train joints` makes a file for the current model; \"none\" uses the centres of parts as joints",
        ))
    }

    /// Returns the map from parts to the joints of a set; without a map, each joint is the centre of a part.
    ///
    /// * `learned`: a consistency file. If it has a map of its own, that map takes precedence over the shipped file of joints.
    pub fn map(&self, learned: Option<&Learned>, set: &JointSet) -> Option<Arc<JointMap>> {
        let learned = learned.filter(|_| is_shipped(&self.from));
        let learned = learned.and_then(|learned| learned.joint_map(set));
        learned.or_else(|| self.file.as_ref()?.map(set))
    }

    /// Returns a text that identifies these positions of joints: it differs if they differ.
    pub fn fingerprint(&self) -> String {
        let text = self.file.as_ref().and_then(|file| file.write().ok());
        text.map_or_else(String::new, |text| {
            format!("{:016x}", formats::checksum::fnv1a(text.as_bytes()))
        })
    }
}

impl std::fmt::Display for Joints {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.file {
            None => out.write_str("the centres of parts"),
            Some(_) if is_shipped(&self.from) => {
                out.write_str("as learned (the file that ships with Parallax)")
            }
            Some(_) => write!(out, "as learned ({})", self.from.display()),
        }
    }
}

fn read(file: &Path) -> Result<JointFile, Failure> {
    let bytes = Shipped::Joints.read(file)?;
    let text = core::str::from_utf8(&bytes).map_err(|_odd| no_text(file))?;
    JointFile::parse(text).map_err(|error| in_file(file, &error))
}
