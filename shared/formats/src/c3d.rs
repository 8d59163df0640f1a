//! Points over time from C3D files, in all six encodings: Intel, DEC and MIPS numbers, as integers or reals; and to files
//! ([`write()`]), as Intel reals.
//!
//! A reader of its own because published ones refuse many files of old laboratories (a missing
//! `POINT:UNITS` or `ANALOG:RATE`, an offset written as a real) that have all the data needed. Analog
//! samples are skipped. Memory is allocated only for data that is in the file, never for a declared
//! count. The format is described in *The C3D File Format* (c3d.org).
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
    /// `[frame][point]`.
    points: Vec<Option<[f64; 3]>>,
}

impl C3d {
    /// Reads the bytes of a file.
    ///
    /// # Errors
    ///
    /// [`C3dError`]. The memory used is at most some tens of bytes per byte of the file.
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

    /// Frames per second of the points; 0 if the file does not have it.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Unit of the positions as in the file: `mm`, `m`; empty if the file does not have it.
    pub fn units(&self) -> &str {
        &self.units
    }

    /// Metres per unit of the positions; millimetres if the file has no unit, `None` for an unknown unit.
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

    /// Number of the first frame in the file (from 1).
    pub fn first_frame(&self) -> u32 {
        self.first_frame
    }

    /// Number of frames.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Number of points in every frame.
    pub fn n_points(&self) -> usize {
        self.n_points
    }

    /// Names of the points; may be fewer than there are points.
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// Index of a point by its full name, or by its name without the subject (`LFWT` of `S1:LFWT`).
    pub fn point(&self, name: &str) -> Option<usize> {
        let is_named = |label: &String| {
            let own = label.rsplit_once(':').map_or(label.as_str(), |parts| parts.1);
            label == name || own == name
        };
        self.labels.iter().position(is_named)
    }

    /// The points of a frame (from 0) in the file's own unit and frame of reference; `None` where a
    /// point was not visible.
    ///
    /// # Panics
    ///
    /// If there is no such frame.
    pub fn frame(&self, frame: usize) -> &[Option<[f64; 3]>] {
        assert!(frame < self.n_frames, "frame {frame} of {}", self.n_frames);
        &self.points[frame * self.n_points..(frame + 1) * self.n_points]
    }
}

/// `POINT:LABELS`, then `LABELS2` and so on: one parameter holds 255 names at most.
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
