//! Boards in footage: looked for in every camera's pictures, or read from a table of corners; cameras calibrated from them.

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

/// The pictures of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFootage {
    /// Its name.
    pub name: String,
    /// A video, a folder, a pattern; or several pictures.
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

    /// Width and height of its pictures.
    ///
    /// # Errors
    ///
    /// Footage that cannot be opened, or has no frames.
    pub fn size(&self) -> Result<[u32; 2], Failure> {
        let first = self.paths.first().ok_or("no pictures").or_fail(ExitKind::Input)?;
        let source = Source::open(&SourceSpec::upright(first)).map_err(footage_failure)?;
        let size = source.info().size;
        Ok([size.width as u32, size.height as u32])
    }
}

/// A name for a camera from the name of its file: what may stand in one.
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

/// Sights of the board by one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Width and height of its pictures.
    pub size: [u32; 2],
    /// Pictures that were looked at.
    pub n_pictures: usize,
    /// Frames with the board, whatever way it was read.
    pub sights: Vec<Sight>,
    /// Pictures whose black is white.
    pub n_inverted: usize,
    /// Pictures in a mirror.
    pub n_mirrored: usize,
    /// Why pictures have no board, with their counts, most first.
    pub nothing: Vec<(Nothing, usize)>,
    /// Where the picture of a frame is: the path, and the picture of it.
    pub pictures: BTreeMap<usize, [usize; 2]>,
}

/// Sights of the board by all cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct Looked {
    /// The board as it is.
    pub board: Board,
    /// How it differs from what was said.
    pub note: Option<String>,
    /// Its points, metres.
    pub layout: Layout,
    /// Sights of each camera.
    pub cameras: Vec<Seen>,
}

impl Looked {
    /// All sights.
    pub fn sights(&self) -> Vec<Sight> {
        self.cameras.iter().flat_map(|camera| camera.sights.clone()).collect()
    }

    /// The cameras whose pictures are mirrored.
    pub fn mirrored(&self) -> Vec<usize> {
        let is_mirrored = |camera: &&Seen| 2 * camera.n_mirrored > camera.sights.len();
        let each = self.cameras.iter().enumerate();
        each.filter(|camera| is_mirrored(&camera.1)).map(|camera| camera.0).collect()
    }
}
