//! Reading of points over time from C3D files in all six encodings (Intel, DEC and MIPS numbers, as integers or reals), and writing of
//! files as Intel reals ([`write()`]).
//!
//! This crate has its own reader because published readers reject many old files from laboratories, although these files contain all the
//! data needed. For example, they lack `POINT:UNITS` or `ANALOG:RATE`, or store an offset as a real. Analog samples are skipped. Memory is
//! allocated only for data that is in the file, never for a declared count. The format is described in *The C3D File Format* (c3d.org).
//!
//! ```
//! let file = include_bytes!("../examples/walk.c3d");
//! let trial = formats::c3d::C3d::parse(file)?;
//! assert_eq!((trial.n_frames(), trial.rate_hz(), trial.units()), (2, 100.0, "mm"));
//! assert_eq!(trial.labels(), ["HEAD", "HIPS"]);
//! let head = trial.point("HEAD").unwrap();
//! assert_eq!(trial.frame(0)[head], Some([0.0, 0.0, 1700.0]));
//! // In the second frame nobody saw the hips.
//! assert_eq!(trial.frame(1)[1], None);
//! # Ok::<(), formats::c3d::C3dError>(())
//! ```

mod error;

mod numbers;

mod header;
mod parameters;

mod write;

#[cfg(test)]
mod tests;

pub use error::C3dError;
pub use write::{Heading, Marker, write};

use header::Header;
use numbers::Bytes;
use parameters::Parameters;

/// The points of one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct C3d {
    rate_hz: f64,
    units: String,
    first_frame: u32,
    labels: Vec<String>,
    n_frames: usize,
    n_points: usize,
    /// Points, as `[frame][point]`.
    points: Vec<Option<[f64; 3]>>,
}

impl C3d {
    /// Parses the bytes of a file.
    ///
    /// # Errors
    ///
    /// Fails with [`C3dError`] if the file is not valid. Parsing uses at most some tens of bytes of memory per byte of the file.
    pub fn parse(file: &[u8]) -> Result<Self, C3dError> {
        let (bytes, section) = Bytes::of_file(file)?;
        let parameters = Parameters::read(bytes, section)?;
        let header = Header::read(bytes, &parameters)?;
        let points = header.points(bytes)?;
        let n_labels = header.n_points.min(file.len());
        Ok(Self {
            rate_hz: header.rate_hz,
            units: parameters.text("POINT", "UNITS").unwrap_or_default(),
            first_frame: header.first_frame,
            labels: labels(&parameters, n_labels),
            n_frames: header.n_frames,
            n_points: header.n_points,
            points,
        })
    }

    /// Returns the frames per second of the points; 0 if the file does not state it.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Returns the unit of the positions as in the file, such as `mm` or `m`; empty if the file does not state it.
    pub fn units(&self) -> &str {
        &self.units
    }

    /// Returns the metres per unit of the positions; millimetres are assumed if the file has no unit. Returns `None` for an unknown unit.
    pub fn metres_per_unit(&self) -> Option<f64> {
        match self.units.to_ascii_lowercase().as_str() {
            "" | "mm" => Some(0.001),
            "cm" => Some(0.01),
            "dm" => Some(0.1),
            "m" => Some(1.0),
            "in" => Some(0.0254),
            _ => None,
        }
    }

    /// Returns the number of the first frame in the file, counted from 1.
    pub fn first_frame(&self) -> u32 {
        self.first_frame
    }

    /// Returns the number of frames.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Returns the number of points in every frame.
    pub fn n_points(&self) -> usize {
        self.n_points
    }

    /// Returns the names of the points; there may be fewer names than points.
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// Returns the index of a point by its full name, or by its name without the subject (`LFWT` for `S1:LFWT`).
    pub fn point(&self, name: &str) -> Option<usize> {
        let is_named = |label: &String| {
            let own = label.rsplit_once(':').map_or(label.as_str(), |parts| parts.1);
            label == name || own == name
        };
        self.labels.iter().position(is_named)
    }

    /// Returns the points of a frame (from 0) in the file's own unit and frame of reference; `None` for a point that was not visible.
    ///
    /// # Panics
    ///
    /// Panics if there is no such frame.
    pub fn frame(&self, frame: usize) -> &[Option<[f64; 3]>] {
        assert!(frame < self.n_frames, "frame {frame} of {}", self.n_frames);
        &self.points[frame * self.n_points..(frame + 1) * self.n_points]
    }
}

/// Returns the names from `POINT:LABELS`, then `LABELS2` and so on, because one parameter has at most 255 names.
fn labels(parameters: &Parameters<'_>, most: usize) -> Vec<String> {
    let mut labels = parameters.texts("POINT", "LABELS", most);
    let mut n = 2;
    while labels.len() < most {
        let more = parameters.texts("POINT", &format!("LABELS{n}"), most - labels.len());
        if more.is_empty() {
            break;
        }
        labels.extend(more);
        n += 1;
    }
    labels
}
