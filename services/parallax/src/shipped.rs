//! The files that ship with Parallax: they are built in, so that they are there wherever the executable is.

use std::borrow::Cow;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use runtime::{ExitKind, Failure};

use crate::inputs;

/// The word that stands for a file that ships, where a file can be named; `./shipped` is a file of that name.
const WORD: &str = "shipped";

/// A file that ships; their cards lie beside them in `configs/models`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shipped {
    /// The person model.
    Model,
    /// The network that predicts the errors of its parts.
    Network,
    /// What its views have in common.
    Consistency,
}

impl Shipped {
    /// What it holds.
    pub(crate) fn bytes(self) -> &'static [u8] {
        match self {
            Self::Model => include_bytes!("../../../configs/models/person.fmp"),
            Self::Network => include_bytes!("../../../configs/models/person.quality.onnx"),
            Self::Consistency => include_bytes!("../../../configs/models/person.consistency"),
        }
    }

    /// What it is called where the word alone would not tell which.
    pub(crate) fn name(self) -> PathBuf {
        let kind = match self {
            Self::Model => "model",
            Self::Network => "network",
            Self::Consistency => "consistency",
        };
        format!("{WORD}:{kind}").into()
    }

    /// The file of that name.
    pub(crate) fn of_name(name: &Path) -> Option<Self> {
        let mut all = [Self::Model, Self::Network, Self::Consistency].into_iter();
        all.find(|it| it.name() == name)
    }

    /// What a file of this kind holds: the one that is named, or the one that ships.
    pub(crate) fn read(self, file: &Path) -> Result<Cow<'static, [u8]>, Failure> {
        if is_one(file) {
            return Ok(Cow::Borrowed(self.bytes()));
        }
        let bytes = fs::read(file).map_err(|error| {
            let failure = inputs::in_file(file, &error);
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
            "`{key}` is a file that `parallax {made_by}` made, or \"{WORD}\": the one that is built in"
        )
    }
}

/// Whether a name is that of a file that ships.
pub(crate) fn is_one(file: &Path) -> bool {
    file == Path::new(WORD)
}

/// A name with relative paths taken as relative to `base`.
pub(crate) fn relative_to(file: &Path, base: &Path) -> PathBuf {
    if is_one(file) {
        return file.to_owned();
    }
    base.join(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_alone_is_built_in_and_a_path_is_a_path() {
        let base = Path::new("/room");
        assert_eq!(relative_to(Path::new(WORD), base), Path::new(WORD));
        for (named, file) in [
            ("./shipped", "/room/./shipped"),
            ("a/shipped", "/room/a/shipped"),
            ("a.onnx", "/room/a.onnx"),
        ] {
            assert!(!is_one(Path::new(named)), "{named}");
            assert_eq!(relative_to(Path::new(named), base), Path::new(file));
        }
    }

    #[test]
    fn each_of_them_is_what_it_is_called() {
        let model = fmp::files::own::decode(Shipped::Model.bytes()).unwrap();
        let n_parts = model.parts.len();
        viewquality::Network::parse(Shipped::Network.bytes().to_vec(), n_parts).unwrap();
        let text = core::str::from_utf8(Shipped::Consistency.bytes()).unwrap();
        consistency::Learned::parse(text).unwrap();
    }
}
