//! ONNX files of which only their card says what they are: networks that find keypoints, or detectors of people.

use std::path::Path;

use failure::Failure;
use keypoints::CardKind;

use crate::cards::{CardText, OnnxFile};
use crate::detector::DetectorFile;
use crate::library::Library;
use crate::network::NetworkFile;

/// An ONNX file, and what its card says it is.
#[derive(Debug)]
pub enum Described {
    /// It finds keypoints, or has no card.
    Network(NetworkFile),
    /// It finds boxes of people.
    Detector(DetectorFile),
}

impl Described {
    /// Reads an ONNX file, and its card if there is one.
    ///
    /// * `card`: the file of the card; if not given, the card is looked for as by [`NetworkFile::open`].
    ///
    /// # Errors
    ///
    /// A file cannot be read, is no network that can be run, or no card.
    pub fn open(path: &Path, card: Option<&Path>) -> Result<Self, Failure> {
        let read = OnnxFile::open(path, card, &Library::BuiltIn)?;
        let kind = read.card.as_ref().and_then(CardText::kind);
        match kind {
            Some(CardKind::Detector) => DetectorFile::of(read).map(Self::Detector),
            _ => NetworkFile::of(read).map(Self::Network),
        }
    }
}
