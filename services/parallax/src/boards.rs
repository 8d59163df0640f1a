//! Calibration of cameras from footage of a board. The corners of the board are found in the pictures, or read from a table.

mod corners;
mod frames;
mod look;
mod overlays;
mod run;

pub use corners::{corners_text, parse_corners, read_corners, write_corners};
pub use frames::{FrameTable, read_frames};
pub use look::{LookSettings, look};
pub use overlays::{Overlay, worst};
pub use run::{Back, BoardSettings, Calibrated, calibrate};

use std::collections::BTreeMap;
use std::path::PathBuf;

use calibration::board::Sight;
use calibration::boards::{Board, Layout, Nothing};
use failure::{ExitKind, Failure, OrFail as _};
use footage::{FootageError, Source, SourceSpec};

/// The footage of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFootage {
    /// Name of the camera.
    pub name: String,
    /// A video, a folder or a pattern; or several single pictures.
    pub paths: Vec<String>,
}

impl CameraFootage {
    /// Reads `NAME=PATH`, or a path whose stem is the name.
    pub fn of(text: &str) -> Self {
        let named = text
            .split_once('=')
            .filter(|(name, path)| geometry::is_plain_name(name) && !path.is_empty());
        let (name, path) = named.map_or_else(
            || (stem(text), text),
            |(name, path)| (name.to_owned(), path),
        );
        Self {
            name,
            paths: vec![path.to_owned()],
        }
    }

    /// Returns the width and height of the camera's pictures.
    ///
    /// # Errors
    ///
    /// Fails if the footage cannot be opened, or has no frames.
    pub fn size(&self) -> Result<[u32; 2], Failure> {
        let first = self.paths.first().ok_or("no pictures").or_fail(ExitKind::Input)?;
        let source = Source::open(&SourceSpec::upright(first)).map_err(footage_failure)?;
        let size = source.info().size;
        Ok([size.width as u32, size.height as u32])
    }
}

/// Returns a name for a camera: the name of its file, without characters that are not allowed in a name.
fn stem(path: &str) -> String {
    let path = PathBuf::from(path);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let plain = stem.chars().map(|c| {
        if c.is_ascii_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '_'
        }
    });
    let plain: String = plain.collect();
    if geometry::is_plain_name(&plain) {
        plain
    } else {
        "camera".to_owned()
    }
}

pub(crate) fn footage_failure(error: FootageError) -> Failure {
    Failure::new(ExitKind::Input, error)
}

/// All sights of the board (pictures in which it was found) in the footage of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Width and height of the camera's pictures.
    pub size: [u32; 2],
    /// Number of pictures that were searched.
    pub n_pictures: usize,
    /// All sights of the board, including sights in inverted and mirrored pictures.
    pub sights: Vec<Sight>,
    /// Number of pictures in which black and white are swapped.
    pub n_inverted: usize,
    /// Number of mirrored pictures.
    pub n_mirrored: usize,
    /// Reasons why the board was not found, with the number of pictures for each, most frequent first.
    pub nothing: Vec<(Nothing, usize)>,
    /// Source of the picture of each frame: index of the path, and index of the picture in that path.
    pub pictures: BTreeMap<usize, [usize; 2]>,
}

/// All sights of the board in the footage of all cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct Looked {
    /// The board that was found in the pictures.
    pub board: Board,
    /// Difference between this board and the board that the user named, if they differ.
    pub note: Option<String>,
    /// Corner points of the board, in metres.
    pub layout: Layout,
    /// Sights of the board by each camera.
    pub cameras: Vec<Seen>,
}

impl Looked {
    /// Returns the sights of all cameras.
    pub fn sights(&self) -> Vec<Sight> {
        self.cameras.iter().flat_map(|camera| camera.sights.clone()).collect()
    }

    /// Returns the indices of the cameras whose pictures are mirrored.
    pub fn mirrored(&self) -> Vec<usize> {
        let is_mirrored = |camera: &&Seen| 2 * camera.n_mirrored > camera.sights.len();
        let each = self.cameras.iter().enumerate();
        each.filter(|camera| is_mirrored(&camera.1)).map(|camera| camera.0).collect()
    }
}
