//! The files that ship with Parallax: they are built in, so that they are there wherever the executable is.

use std::borrow::Cow;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use deployment::{SHIPPED, is_shipped};
use runtime::{ExitKind, Failure};

use runtime::in_file;

/// A file that ships; their cards lie beside them in `configs/models`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shipped {
    /// The person model.
    Model,
    /// The network that predicts the errors of its parts.
    Network,
    /// What its views have in common.
    Consistency,
}

impl Shipped {
    /// What it holds.
    pub fn bytes(self) -> &'static [u8] {
        match self {
            Self::Model => include_bytes!("../../../configs/models/person.fmp"),
            Self::Network => include_bytes!("../../../configs/models/person.quality.onnx"),
            Self::Consistency => include_bytes!("../../../configs/models/person.consistency"),
        }
    }

    /// What it is called where the word alone would not tell which.
    pub fn name(self) -> PathBuf {
        let kind = match self {
            Self::Model => "model",
            Self::Network => "network",
            Self::Consistency => "consistency",
        };
        format!("{SHIPPED}:{kind}").into()
    }

    /// The file of that name.
    pub fn of_name(name: &Path) -> Option<Self> {
        let mut all = [Self::Model, Self::Network, Self::Consistency].into_iter();
        all.find(|it| it.name() == name)
    }

    /// What a file of this kind holds: the one that is named, or the one that ships.
    ///
    /// # Errors
    ///
    /// The file is not there, cannot be read, or is empty.
    pub fn read(self, file: &Path) -> Result<Cow<'static, [u8]>, Failure> {
        if is_shipped(file) {
            return Ok(Cow::Borrowed(self.bytes()));
        }
        let bytes = fs::read(file).map_err(|error| {
            let failure = in_file(file, &error);
            let is_absent = error.kind() == ErrorKind::NotFound;
            if is_absent {
                failure.with_hint(self.hint())
            } else {
                failure
            }
        })?;
        if bytes.is_empty() {
            let message = format!("{} is empty (0 bytes)", file.display());
            return Err(Failure::new(ExitKind::Input, message).with_hint(self.hint()));
        }
        Ok(Cow::Owned(bytes))
    }

    /// What to name in place of a file that is not there.
    fn hint(self) -> String {
        let [key, made_by] = match self {
            Self::Model => ["model", "train fmp"],
            Self::Network => ["quality.network", "train quality"],
            Self::Consistency => ["fuse.consistency", "train consistency"],
        };
        format!(
            "`{key}` is a file that `parallax {made_by}` made, or \"{SHIPPED}\": the one that is built in"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_them_is_what_it_is_called() {
        let model = fmp::files::own::decode(Shipped::Model.bytes()).unwrap();
        let n_parts = model.parts.len();
        viewquality::Network::parse(Shipped::Network.bytes().to_vec(), n_parts).unwrap();
        let text = core::str::from_utf8(Shipped::Consistency.bytes()).unwrap();
        consistency::Learned::parse(text).unwrap();
    }
}
