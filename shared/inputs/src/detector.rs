//! Detectors of people from files: an ONNX file and its card.

use std::path::Path;

use deployment::is_shipped;
use failure::{Failure, in_file};
use footage::{ACCENT, Canvas, line_width};
use kernels::Rgb8View;
use keypoints::{DetectorCard, PersonBox};
use posenetwork::Detector;

use crate::cards::{CardFile, OnnxFile};
use crate::library::Library;
use crate::pictures::Picture;
use crate::refused::refused;
use crate::shipped::Shipped;

/// A detector file that was read.
pub type DetectorFile = CardFile<DetectorCard>;

impl DetectorFile {
    pub(crate) fn of(file: OnnxFile) -> Result<Self, Failure> {
        Self::read(file, DetectorCard::parse)
    }

    /// Returns the detector, after a test run on an empty picture.
    ///
    /// # Errors
    ///
    /// Fails if the detector has no card, or does not match its card.
    pub fn fitted(self) -> Result<Detector, Failure> {
        self.fit(("detector", "--detector-card"), Detector::new)
    }
}

/// Reads a detector and its card, and runs it once as a test.
///
/// * `card`: file of the card; if it is `None`, the card is searched for as in
///   [`NetworkFile::open`](crate::network::NetworkFile::open).
///
/// # Errors
///
/// Fails if a file cannot be read, is not a runnable network, is not a card, or if the two do not fit.
pub fn open(path: &Path, card: Option<&Path>) -> Result<Detector, Failure> {
    open_with(path, card, &Library::BuiltIn)
}

/// Works like [`open`], with a given library; `shipped` means the shipped detector.
///
/// # Errors
///
/// Fails like [`open`].
pub fn open_with(path: &Path, card: Option<&Path>, library: &Library) -> Result<Detector, Failure> {
    if is_shipped(path) {
        let shipped = Shipped::Detector;
        let read = OnnxFile::built_in(&shipped.name(), shipped.bytes(), library)?;
        return DetectorFile::of(read)?.fitted();
    }
    DetectorFile::of(OnnxFile::open(path, card, library)?)?.fitted()
}

/// Returns the boxes of people that a detector finds in a picture, in pixels, in descending order of score.
///
/// # Errors
///
/// Fails if the detector cannot be run, or gives values that are not finite.
pub fn people(
    detector: &Detector,
    picture: &Picture,
    values: &mut Vec<f32>,
) -> Result<Vec<PersonBox>, Failure> {
    let size = picture.size;
    let image = Rgb8View::new(size.width, size.height, &picture.rgb);
    let image = image.map_err(|error| in_file(&picture.path, &error))?;
    let found = detector.people(image, values);
    found.map_err(|error| refused(&picture.path, &error))
}

/// Draws the boxes of people on a picture, each with its score; the box with the highest score is on top.
pub fn drawn(picture: &Picture, people: &[PersonBox]) -> Canvas {
    let mut canvas = Canvas::from_rgb(picture.size, &picture.rgb);
    for it in people.iter().rev() {
        let [left, top, ..] = it.outline;
        canvas.frame(it.outline, 0.5 * line_width(picture.size), ACCENT);
        let corner = [left.max(0.0) + 4.0, top.max(0.0) + 4.0];
        canvas.label(corner, &format!("{:.2}", it.score), ACCENT);
    }
    canvas
}
