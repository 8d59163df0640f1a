//! ONNX files whose card states whether they find keypoints or people.

use std::path::Path;

use failure::Failure;
use keypoints::CardKind;

use crate::cards::{CardText, OnnxFile};
use crate::detector::DetectorFile;
use crate::library::Library;
use crate::network::NetworkFile;

/// An ONNX file of the kind that its card declares.
#[derive(Debug)]
pub enum Described {
    /// A network that finds keypoints, or a network without a card.
    Network(NetworkFile),
    /// A detector that finds boxes of people.
    Detector(DetectorFile),
}

impl Described {
    /// Reads an ONNX file, and its card if there is one.
    ///
    /// * `card`: file of the card; if it is `None`, the card is searched for as in [`NetworkFile::open`].
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read, is not a runnable network, or is not a card.
    pub fn open(path: &Path, card: Option<&Path>) -> Result<Self, Failure> {
        let read = OnnxFile::open(path, card, &Library::BuiltIn)?;
        let kind = read.card.as_ref().and_then(CardText::kind);
        match kind {
            Some(CardKind::Detector) => DetectorFile::of(read).map(Self::Detector),
            _ => NetworkFile::of(read).map(Self::Network),
        }
    }
}
