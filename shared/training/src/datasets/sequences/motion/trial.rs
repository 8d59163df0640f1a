//! The markers of a C3D or TRC file, as stored.

use std::path::Path;

use formats::c3d::C3d;
use formats::trc::Trc;

use super::{MotionError, MotionOptions};

/// Markers over time, in the file's unit and frame of reference.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) rate_hz: f64,
    unit: String,
    /// Number of the first frame in the file.
    pub(super) first: u32,
    /// Names of the markers; empty if a marker has no name.
    pub(super) names: Vec<String>,
    /// Positions of the markers, `[frame][marker]`; `None` if the marker was not seen.
    pub(super) frames: Vec<Vec<Option<[f64; 3]>>>,
}

impl Trial {
    /// Reads a file. The extension determines the format.
    pub(super) fn read(path: &Path) -> Result<Self, MotionError> {
        let bytes = std::fs::read(path).map_err(|source| MotionError::Io {
            path: path.to_owned(),
            source,
        })?;
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let trial = match ending.to_str() {
            Some("c3d") => Self::of_c3d(path, &bytes)?,
            Some("trc") => Self::of_trc(path, &bytes)?,
            _ => {
                let path = path.to_owned();
                return Err(MotionError::Kind { path });
            }
        };
        let rate_hz = trial.rate_hz;
        if !(1.0..=100_000.0).contains(&rate_hz) {
            let path = path.to_owned();
            return Err(MotionError::Rate { path, rate_hz });
        }
        Ok(trial)
    }

    fn of_c3d(path: &Path, bytes: &[u8]) -> Result<Self, MotionError> {
        let trial = C3d::parse(bytes).map_err(|source| MotionError::C3d {
            path: path.to_owned(),
            source,
        })?;
        // Many programs write a marker that was not visible as a point exactly at the origin.
        let seen = |marker: &Option<[f64; 3]>| marker.filter(|point| *point != [0.0; 3]);
        let names = trial.labels().iter();
        let without_subject = |label: &String| match label.rsplit_once(':') {
            Some((_, name)) => name.to_owned(),
            None => label.clone(),
        };
        Ok(Self {
            rate_hz: trial.rate_hz(),
            unit: match trial.units().trim() {
                // The unit used in the format's examples.
                "" => "mm".to_owned(),
                unit => unit.to_owned(),
            },
            first: trial.first_frame(),
            names: names.map(without_subject).collect(),
            frames: (0..trial.n_frames())
                .map(|frame| trial.frame(frame).iter().map(seen).collect())
                .collect(),
        })
    }

    fn of_trc(path: &Path, bytes: &[u8]) -> Result<Self, MotionError> {
        let trial = Trc::parse(&String::from_utf8_lossy(bytes));
        let trial = trial.map_err(|source| MotionError::Trc {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            rate_hz: trial.rate_hz,
            unit: trial.units,
            first: 1,
            names: trial.markers,
            frames: trial.frames,
        })
    }

    /// Index of a marker in a frame.
    pub(super) fn marker(&self, name: &str) -> Option<usize> {
        let n_points = self.frames.first().map_or(0, Vec::len);
        let place = self.names.iter().position(|known| known == name);
        place.filter(|place| *place < n_points)
    }

    /// The requested frames.
    pub(super) fn part(
        mut self,
        path: &Path,
        options: &MotionOptions,
    ) -> Result<Self, MotionError> {
        let n = self.frames.len() as u32;
        let has = [self.first, self.first + n.saturating_sub(1)];
        let asked = options.frames.unwrap_or(has);
        if n == 0 || asked[0] < has[0] || asked[1] > has[1] || asked[0] > asked[1] {
            let path = path.to_owned();
            return Err(MotionError::Frames { path, asked, has });
        }
        self.frames.truncate((asked[1] - has[0] + 1) as usize);
        self.frames.drain(..(asked[0] - has[0]) as usize);
        self.first = asked[0];
        Ok(self)
    }

    /// Length of the file's unit in metres.
    pub(super) fn metres_per_unit(&self, path: &Path) -> Result<f64, MotionError> {
        super::table::metres_per(&self.unit).ok_or_else(|| MotionError::Unit {
            path: path.to_owned(),
            unit: self.unit.clone(),
        })
    }
}
