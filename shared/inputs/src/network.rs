//! Networks that find keypoints, from files: an ONNX file and its card.

mod drawn;
mod nearest;

use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _, in_file};
use footage::Size;
use kernels::Rgb8View;
use keypoints::Card;
use posenetwork::{
    JointMaps, LookMemory, Looker, MapSettings, PoseNetwork, Sight, Turn, Workspace,
};
use serde_json::{Value, json};

use crate::cards::{CardFile, OnnxFile};
use crate::library::Library;
use crate::pictures::Picture;
use crate::refused::refused;

pub use drawn::{limbs, sheet};
pub use nearest::{nearest, nearest_detectors};

/// A network file that was read.
pub type NetworkFile = CardFile<Card>;

impl NetworkFile {
    /// Reads a network, and its card if there is one.
    ///
    /// * `card`: file of the card. If it is `None`, the card is the first of these that exists: a file beside the network, in whose name
    ///   `.toml` replaces or follows `.onnx`; the entry [`METADATA_KEY`](crate::cards::METADATA_KEY) of the network.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read, is not a runnable network, or is not a card.
    pub fn open(path: &Path, card: Option<&Path>) -> Result<Self, Failure> {
        Self::open_with(path, card, &Library::BuiltIn)
    }

    /// Works like [`Self::open`], with a given library.
    ///
    /// # Errors
    ///
    /// Fails like [`Self::open`].
    pub fn open_with(path: &Path, card: Option<&Path>, library: &Library) -> Result<Self, Failure> {
        Self::of(OnnxFile::open(path, card, library)?)
    }

    /// Loads a built-in network with a given library.
    ///
    /// * `name`: name of the network in errors.
    ///
    /// # Errors
    ///
    /// Fails if the bytes are not a runnable network, or if the card is not valid.
    pub fn built_in(name: &Path, bytes: &[u8], library: &Library) -> Result<Self, Failure> {
        Self::of(OnnxFile::built_in(name, bytes, library)?)
    }

    pub(crate) fn of(file: OnnxFile) -> Result<Self, Failure> {
        Self::read(file, Card::parse)
    }

    /// Returns the network, after a test run on an empty picture.
    ///
    /// # Errors
    ///
    /// Fails if the network has no card, or does not match its card.
    pub fn fitted(self) -> Result<PoseNetwork, Failure> {
        self.fit(("network", "--card"), PoseNetwork::new)
    }
}

/// Runs a network on a box of a picture, given as left, top, right, bottom in pixels.
///
/// * `turn`: rotation of the picture for the network.
///
/// # Errors
///
/// Fails if the network cannot be run or gives values that are not finite, or if the box is empty.
pub fn look<'a>(
    network: &'a PoseNetwork,
    picture: &Picture,
    (outline, turn): ([f64; 4], Turn),
    workspace: &'a mut Workspace,
) -> Result<Sight<'a>, Failure> {
    let Size { width, height } = picture.size;
    let image = Rgb8View::new(width, height, &picture.rgb);
    let image = image.map_err(|error| in_file(&picture.path, &error))?;
    let sight = network.look_turned(image, (outline, turn), workspace);
    let sight = sight.map_err(|error| refused(&picture.path, &error))?;
    sight.ok_or_else(|| {
        let message = format!(
            "{}: the box of the person has no area",
            picture.path.display()
        );
        Failure::new(ExitKind::Input, message)
    })
}

/// Returns the box that best fits a person who was seen in a given box, and the rotation of the picture in that box. The box is determined
/// by the method that a run uses ([`Looker::look_closer`]).
///
/// * `outline`: box in which the person is seen, in pixels of the picture.
///
/// # Errors
///
/// Fails like [`look`].
pub fn closest(
    network: &PoseNetwork,
    picture: &Picture,
    outline: [f64; 4],
    memory: &mut LookMemory,
) -> Result<([f64; 4], Turn), Failure> {
    let Size { width, height } = picture.size;
    let image = Rgb8View::new(width, height, &picture.rgb);
    let image = image.map_err(|error| in_file(&picture.path, &error))?;
    let as_it_is = (outline, Turn::Up);
    let looker = Looker {
        network,
        settings: &MapSettings::default(),
    };
    let mut maps = JointMaps::default();
    let outlines = &[outline][..];
    let seen = looker.best_of((image, outlines), Turn::Up, memory, &mut maps);
    let seen = seen.map_err(|error| refused(&picture.path, &error))?;
    Ok(seen.map_or(as_it_is, |seen| (seen.outline, seen.turn)))
}

/// Returns the keypoints with their names as JSON, in pixels of the picture.
///
/// # Errors
///
/// Fails if the output of the network cannot be decoded.
pub fn keypoints_json(sight: &Sight<'_>) -> Result<Vec<Value>, Failure> {
    let found = sight.keypoints().or_fail(ExitKind::Input)?;
    let names = sight.network().names().iter();
    let each = names.zip(found);
    let each = each
        .map(|(name, it)| json!({ "name": name, "x": it.at[0], "y": it.at[1], "score": it.score }));
    Ok(each.collect())
}

#[cfg(test)]
mod tests;
