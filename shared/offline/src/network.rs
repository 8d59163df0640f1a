//! Networks that find keypoints, from files: an ONNX file and its card.

mod drawn;
mod nearest;

use std::error::Error;
use std::path::{Path, PathBuf};

use footage::Size;
use inference::{Description, Session};
use kernels::Rgb8View;
use keypoints::Card;
use posenetwork::{PoseNetwork, Sight, Workspace};
use runtime::{ExitKind, Failure, in_file, read_text};

use crate::pictures::Picture;

pub use drawn::{limbs, sheet};
pub use nearest::nearest;

/// The entry of an ONNX file's `metadata_props` that holds the text of its card.
pub const METADATA_KEY: &str = "parallax.card";

/// Where a card was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CardPlace {
    /// In a file.
    File(PathBuf),
    /// In the network's own file.
    Metadata,
}

impl core::fmt::Display for CardPlace {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::File(file) => write!(to, "{}", file.display()),
            Self::Metadata => write!(to, "`{METADATA_KEY}` in the file"),
        }
    }
}

/// What runs networks.
#[derive(Debug, Default)]
pub enum Library {
    /// The library that is built in.
    #[default]
    BuiltIn,
    /// ONNX Runtime, which the user provides.
    #[cfg(feature = "ort")]
    OnnxRuntime(inference::OnnxRuntime),
}

impl Library {
    /// Loads ONNX Runtime.
    ///
    /// * `file`: the library, for example `/usr/lib/libonnxruntime.so`.
    ///
    /// # Errors
    ///
    /// It cannot be loaded.
    #[cfg(feature = "ort")]
    pub fn load(file: &Path) -> Result<Self, Failure> {
        let loaded = inference::OnnxRuntime::load(file);
        loaded
            .map(Self::OnnxRuntime)
            .map_err(|error| refused(file, &error))
    }

    /// Loads ONNX Runtime.
    ///
    /// * `file`: the library, for example `/usr/lib/libonnxruntime.so`.
    ///
    /// # Errors
    ///
    /// Always: this Parallax was built without it.
    #[cfg(not(feature = "ort"))]
    pub fn load(file: &Path) -> Result<Self, Failure> {
        let message = format!(
            "{}: ONNX Runtime, but this Parallax was built without it: build it with --features ort",
            file.display()
        );
        Err(Failure::new(ExitKind::Config, message))
    }

    /// Loads a network.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is no network that can be run.
    pub(crate) fn session(&self, path: &Path) -> Result<Session, Failure> {
        let bytes = std::fs::read(path).map_err(|error| in_file(path, &error))?;
        let session = match self {
            Self::BuiltIn => Session::parse(bytes),
            #[cfg(feature = "ort")]
            Self::OnnxRuntime(runtime) => Session::parse_with(runtime, &bytes),
        };
        session.map_err(|error| refused(path, &error))
    }
}

/// An ONNX file that was read.
#[derive(Debug)]
pub struct NetworkFile {
    path: PathBuf,
    session: Session,
    card: Option<(Card, CardPlace)>,
}

impl NetworkFile {
    /// Reads a network, and its card if there is one.
    ///
    /// * `card`: the file of the card. If not given it is the first of: the file beside the network whose ending is `.toml`
    ///   in place of `.onnx`, or after it; the entry [`METADATA_KEY`] of the network.
    ///
    /// # Errors
    ///
    /// A file cannot be read, is no network that can be run, or no card.
    pub fn open(path: &Path, card: Option<&Path>) -> Result<Self, Failure> {
        Self::open_with(path, card, &Library::BuiltIn)
    }

    /// As [`Self::open`], run by a library of choice.
    ///
    /// # Errors
    ///
    /// As for [`Self::open`].
    pub fn open_with(path: &Path, card: Option<&Path>, library: &Library) -> Result<Self, Failure> {
        let session = library.session(path)?;
        let card = card_of(path, card, session.description())?;
        Ok(Self {
            path: path.to_path_buf(),
            session,
            card,
        })
    }

    /// What it takes and gives.
    pub fn description(&self) -> &Description {
        self.session.description()
    }

    /// Its card, and where that was found.
    pub fn card(&self) -> Option<&(Card, CardPlace)> {
        self.card.as_ref()
    }

    /// The network, which is tried once on an empty picture.
    ///
    /// # Errors
    ///
    /// It has no card, or does not fit it.
    pub fn fitted(self) -> Result<PoseNetwork, Failure> {
        let Self {
            path,
            session,
            card,
        } = self;
        let Some((card, place)) = card else {
            let message = format!("{}: the network has no card", path.display());
            let hint = format!(
                "`parallax model show {}` says which of the cards in configs/networks comes nearest: give it with --card, or \
                 put it beside the network as {}; docs/networks.md says how to write one",
                path.display(),
                path.with_extension("toml").display()
            );
            return Err(Failure::new(ExitKind::Input, message).with_hint(hint));
        };
        PoseNetwork::new(session, card).map_err(|error| {
            let message = format!(
                "{} does not fit its card ({place}): {}",
                path.display(),
                causes::in_one_line(&error)
            );
            let hint = "docs/networks.md says what the keys of a card mean";
            Failure::new(ExitKind::Input, message).with_hint(hint)
        })
    }
}

/// What a network sees in a box of a picture: left, top, right, bottom, pixels.
///
/// # Errors
///
/// The network cannot be run, or gives values that are not finite; the box has no extent.
pub fn look<'a>(
    network: &'a PoseNetwork,
    picture: &Picture,
    outline: [f64; 4],
    workspace: &'a mut Workspace,
) -> Result<Sight<'a>, Failure> {
    let Size { width, height } = picture.size;
    let image = Rgb8View::new(width, height, &picture.rgb);
    let image = image.map_err(|error| in_file(&picture.path, &error))?;
    let sight = network.look(image, outline, workspace);
    let sight = sight.map_err(|error| refused(&picture.path, &error))?;
    sight.ok_or_else(|| {
        let message = format!("{}: a box without an extent", picture.path.display());
        Failure::new(ExitKind::Input, message)
    })
}

fn refused(path: &Path, error: &(dyn Error + 'static)) -> Failure {
    let message = format!("{}: {}", path.display(), causes::in_one_line(error));
    Failure::new(ExitKind::Input, message)
}

fn card_of(
    network: &Path,
    given: Option<&Path>,
    description: &Description,
) -> Result<Option<(Card, CardPlace)>, Failure> {
    let instead = network.with_extension("toml");
    let mut after = network.as_os_str().to_owned();
    after.push(".toml");
    let beside = [instead, PathBuf::from(after)];
    let beside = beside.iter().find(|it| it.is_file()).map(PathBuf::as_path);
    if let Some(file) = given.or(beside) {
        let card = Card::parse(&read_text(file)?).map_err(|error| in_file(file, &error))?;
        return Ok(Some((card, CardPlace::File(file.to_path_buf()))));
    }
    let entry = description.metadata.iter();
    let Some((_, text)) = entry.rev().find(|it| it.0 == METADATA_KEY) else {
        return Ok(None);
    };
    let card = Card::parse(text).map_err(|error| {
        let message = format!("{}: `{METADATA_KEY}`: {error}", network.display());
        Failure::new(ExitKind::Input, message)
    })?;
    Ok(Some((card, CardPlace::Metadata)))
}

#[cfg(test)]
mod tests;
