//! Search for the card of an ONNX file, the text that describes how Parallax uses the network.

use std::error::Error;
use std::path::{Path, PathBuf};

use failure::{ExitKind, Failure, in_file, read_text};
use inference::{Description, RunBy, Session};
use keypoints::{CardError, CardKind};

use crate::library::Library;

/// Entry of an ONNX file's `metadata_props` that contains the text of its card.
pub const METADATA_KEY: &str = "parallax.card";

/// Place where a card was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CardPlace {
    /// A separate file.
    File(PathBuf),
    /// The metadata in the network's own file.
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

/// An ONNX file, and the text of its card.
#[derive(Debug)]
pub(crate) struct OnnxFile {
    pub(crate) path: PathBuf,
    pub(crate) session: Session,
    pub(crate) card: Option<CardText>,
}

/// An ONNX file that was read, with its card if there is one.
#[derive(Debug)]
pub struct CardFile<C> {
    path: PathBuf,
    session: Session,
    card: Option<(C, CardPlace)>,
}

impl<C> CardFile<C> {
    /// Parses the card.
    pub(crate) fn read(
        file: OnnxFile,
        parse: impl FnOnce(&str) -> Result<C, CardError>,
    ) -> Result<Self, Failure> {
        let OnnxFile {
            path,
            session,
            card,
        } = file;
        let card = card.map(|card| card.read(&path, parse));
        Ok(Self {
            card: card.transpose()?,
            path,
            session,
        })
    }

    /// Returns the description of the network's inputs and outputs.
    pub fn description(&self) -> &Description {
        self.session.description()
    }

    /// Returns the library that runs the network.
    pub fn run_by(&self) -> &RunBy {
        self.session.run_by()
    }

    /// Returns the card and the place where it was found.
    pub fn card(&self) -> Option<&(C, CardPlace)> {
        self.card.as_ref()
    }

    /// Combines the network and its card.
    ///
    /// * `kind`, `option`: kind of the network, and the option for its card, for the hint.
    pub(crate) fn fit<T, E: Error + 'static>(
        self,
        (kind, option): (&str, &str),
        make: impl FnOnce(Session, C) -> Result<T, E>,
    ) -> Result<T, Failure> {
        let path = &self.path;
        let Some((card, place)) = self.card else {
            let message = format!("{}: this {kind} has no card", path.display());
            let hint = format!(
                "`parallax-lab model show {}` prints the most similar card in configs/{kind}s: pass that card to {option}, or put a copy \
                 beside the {kind} as {}; docs/networks.md explains how to write a card",
                failure::wording::shell(path.display()),
                path.with_extension("toml").display()
            );
            return Err(Failure::new(ExitKind::Input, message).with_hint(hint));
        };
        make(self.session, card).map_err(|error| misfit(path, &place, &error))
    }
}

/// The text of a card that is not parsed yet.
#[derive(Debug)]
pub(crate) struct CardText {
    text: String,
    place: CardPlace,
}

impl OnnxFile {
    /// Loads a network, and finds its card.
    pub(crate) fn open(
        path: &Path,
        card: Option<&Path>,
        library: &Library,
    ) -> Result<Self, Failure> {
        let bytes = files::read(path, files::MODEL).map_err(|error| in_file(path, &error))?;
        let session = library.session(path, bytes)?;
        let card = match CardText::beside(path, card)? {
            Some(card) => Some(card),
            None => CardText::within(session.description()),
        };
        Ok(Self {
            path: path.to_path_buf(),
            session,
            card,
        })
    }

    /// Loads a built-in network, whose card is in its metadata.
    ///
    /// * `name`: name of the network in errors.
    pub(crate) fn built_in(name: &Path, bytes: &[u8], library: &Library) -> Result<Self, Failure> {
        let session = library.session(name, bytes.to_vec())?;
        Ok(Self {
            path: name.to_path_buf(),
            card: CardText::within(session.description()),
            session,
        })
    }
}

impl CardText {
    /// Returns the card of a network from a file: the given file, or a file beside the network.
    fn beside(network: &Path, given: Option<&Path>) -> Result<Option<Self>, Failure> {
        let Some(file) = given.map(Path::to_path_buf).or_else(|| card_beside(network)) else {
            return Ok(None);
        };
        Ok(Some(Self {
            text: read_text(&file)?,
            place: CardPlace::File(file),
        }))
    }

    /// Returns the card of a network from its metadata.
    fn within(description: &Description) -> Option<Self> {
        let mut entries = description.metadata.iter().rev();
        let entry = entries.find(|entry| entry.0 == METADATA_KEY);
        entry.map(|(_, text)| Self {
            text: text.clone(),
            place: CardPlace::Metadata,
        })
    }

    /// Returns the kind that the card declares; `None` if it declares none.
    pub(crate) fn kind(&self) -> Option<CardKind> {
        CardKind::of(&self.text)
    }

    /// Parses the card.
    ///
    /// * `network`: file of the network that the card belongs to.
    fn read<T>(
        self,
        network: &Path,
        parse: impl FnOnce(&str) -> Result<T, CardError>,
    ) -> Result<(T, CardPlace), Failure> {
        let Self { text, place } = self;
        let card = parse(&text).map_err(|error| match &place {
            CardPlace::File(file) => in_file(file, &error),
            CardPlace::Metadata => {
                let message = format!("{}: `{METADATA_KEY}`: {error}", network.display());
                Failure::new(ExitKind::Input, message)
            }
        })?;
        Ok((card, place))
    }
}

/// Returns the card file beside a network: `pose.toml` or `pose.onnx.toml` for `pose.onnx`.
pub fn card_beside(network: &Path) -> Option<PathBuf> {
    let mut after = network.as_os_str().to_owned();
    after.push(".toml");
    let places = [network.with_extension("toml"), PathBuf::from(after)];
    places.into_iter().find(|place| place.is_file())
}

/// Returns the failure for a network that does not match its card.
fn misfit(path: &Path, place: &CardPlace, error: &(dyn Error + 'static)) -> Failure {
    let message = format!(
        "{} does not match its card ({place}): {}",
        path.display(),
        failure::wording::in_one_line(error)
    );
    let hint = "docs/networks.md explains the keys of a card";
    Failure::new(ExitKind::Input, message).with_hint(hint)
}
