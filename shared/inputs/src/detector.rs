//! Detectors of people from files: an ONNX file and its card.

use std::path::{Path, PathBuf};

use deployment::is_shipped;
use failure::{ExitKind, Failure, in_file};
use footage::{ACCENT, Canvas, line_width};
use inference::{Description, Session};
use kernels::Rgb8View;
use keypoints::{DetectorCard, PersonBox};
use posenetwork::Detector;

use crate::cards::{CardPlace, OnnxFile, misfit};
use crate::library::Library;
use crate::pictures::Picture;
use crate::refused::refused;
use crate::shipped::Shipped;

/// A detector that was read.
#[derive(Debug)]
pub struct DetectorFile {
    path: PathBuf,
    session: Session,
    card: Option<(DetectorCard, CardPlace)>,
}

impl DetectorFile {
    pub(crate) fn of(read: OnnxFile) -> Result<Self, Failure> {
        let OnnxFile {
            path,
            session,
            card,
        } = read;
        let card = card.map(|card| card.read(&path, DetectorCard::parse));
        Ok(Self {
            card: card.transpose()?,
            path,
            session,
        })
    }

    /// Returns the description of its inputs and outputs.
    pub fn description(&self) -> &Description {
        self.session.description()
    }

    /// Its card, and where that was found.
    pub fn card(&self) -> Option<&(DetectorCard, CardPlace)> {
        self.card.as_ref()
    }

    /// The detector, which is tried once on an empty picture.
    ///
    /// # Errors
    ///
    /// It has no card, or does not fit it.
    pub fn fitted(self) -> Result<Detector, Failure> {
        let Self {
            path,
            session,
            card,
        } = self;
        let Some((card, place)) = card else {
            let message = format!("{}: the detector has no card", path.display());
            let hint = format!(
                "`parallax-lab model show {}` says which of the cards in configs/detectors comes nearest: give it with \
                 --detector-card, or put it beside the detector as {}; docs/networks.md says how to write one",
                failure::wording::shell(path.display()),
                path.with_extension("toml").display()
            );
            return Err(Failure::new(ExitKind::Input, message).with_hint(hint));
        };
        Detector::new(session, card).map_err(|error| misfit(&path, &place, &error))
    }
}

/// Reads a detector and its card, and tries it once.
///
/// * `card`: the file of the card; if not given, it is looked for as that of a network is
///   ([`NetworkFile::open`](crate::network::NetworkFile::open)).
///
/// # Errors
///
/// A file cannot be read, is no network that can be run, is no card, or the two do not fit.
pub fn open(path: &Path, card: Option<&Path>) -> Result<Detector, Failure> {
    open_with(path, card, &Library::BuiltIn)
}

/// As [`open`], run by a library of choice; `shipped` stands for the detector that ships.
///
/// # Errors
///
/// As for [`open`].
pub fn open_with(path: &Path, card: Option<&Path>, library: &Library) -> Result<Detector, Failure> {
    if is_shipped(path) {
        let shipped = Shipped::Detector;
        let read = OnnxFile::built_in(&shipped.name(), shipped.bytes(), library)?;
        return DetectorFile::of(read)?.fitted();
    }
    DetectorFile::of(OnnxFile::open(path, card, library)?)?.fitted()
}

/// The people that a detector finds in a picture, the surest first; pixels.
///
/// # Errors
///
/// The detector cannot be run, or gives values that are not finite.
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

/// Draws the boxes of people over a picture, each with its score; the surest one last, on top.
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
