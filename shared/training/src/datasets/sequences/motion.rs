//! The motion of one person from a C3D or TRC file: joints over time, in metres, z up.
//!
//! A [`MarkerTable`] converts markers to joints. Gaps are interpolated up to a limit. The motion is checked for plausibility: the legs have
//! a possible length, the head is above the feet, and the knees bend backward. The last check finds mirrored axes, and left and right
//! joints that are swapped.

mod check;
mod error;
mod presets;
mod table;
mod trial;

use std::path::Path;

pub use error::MotionError;
pub use presets::PRESETS;
pub use table::MarkerTable;

use skeleton::PARSE14;
use trial::Trial;

/// Options for reading a motion file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionOptions {
    /// First and last frame, numbered as in the file; all frames if `None`.
    pub frames: Option<[u32; 2]>,
    /// Longest gap of a marker that is interpolated linearly, in seconds.
    pub max_gap_s: f64,
}

impl Default for MotionOptions {
    /// Reads all frames, and interpolates gaps of up to a quarter of a second.
    fn default() -> Self {
        Self {
            frames: None,
            max_gap_s: 0.25,
        }
    }
}

/// The joints of a person over time, in metres, z up.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Number of postures per second.
    pub rate_hz: f64,
    /// The joints of `skeleton::PARSE14` in each frame.
    pub joints: Vec<[[f64; 3]; 14]>,
    /// The toes of the right and of the left foot in each frame; `None` if the table does not define them.
    pub toes: Option<Vec<[[f64; 3]; 2]>>,
}

/// Reads a file.
///
/// * `table`: converts markers to joints; if `None`, the first of [`PRESETS`] whose markers all exist.
///
/// # Errors
///
/// Fails with [`MotionError`].
pub fn read_motion(
    file: &Path,
    table: Option<&MarkerTable>,
    options: &MotionOptions,
) -> Result<Motion, MotionError> {
    let trial = Trial::read(file)?;
    let table = match table {
        Some(table) => table.clone(),
        None => preset_for(&trial).ok_or_else(|| MotionError::NoPreset {
            path: file.to_owned(),
            markers: trial.names.clone(),
        })?,
    };
    let trial = trial.part(file, options)?;
    let columns = Columns::new(file, &trial, &table, options)?;
    let names = PARSE14.joints.iter().map(|joint| joint.name);
    let joints: Vec<Vec<[f64; 3]>> =
        names.map(|joint| columns.joint(&table, joint)).collect::<Result<_, _>>()?;
    let toes = if table.has_toes() {
        let [right, left] = ["right toes", "left toes"].map(|joint| columns.joint(&table, joint));
        Some((right?, left?))
    } else {
        None
    };
    let n = trial.frames.len();
    let motion = Motion {
        rate_hz: trial.rate_hz,
        joints: (0..n).map(|frame| core::array::from_fn(|joint| joints[joint][frame])).collect(),
        toes: toes.map(|(right, left)| right.into_iter().zip(left).map(<[_; 2]>::from).collect()),
    };
    check::check(file, &motion)?;
    Ok(motion)
}

/// The first preset whose markers all exist in a trial.
fn preset_for(trial: &Trial) -> Option<MarkerTable> {
    let mut tables = PRESETS.iter().filter_map(|name| MarkerTable::preset(name));
    tables.find(|table| table.markers().all(|name| trial.marker(name).is_some()))
}

/// The markers that a table needs, without gaps, in metres, z up.
struct Columns<'a> {
    path: &'a Path,
    of_marker: Vec<(String, Vec<[f64; 3]>)>,
}

impl<'a> Columns<'a> {
    fn new(
        path: &'a Path,
        trial: &Trial,
        table: &MarkerTable,
        options: &MotionOptions,
    ) -> Result<Self, MotionError> {
        let metres = match table.unit_metres() {
            Some(given) => given,
            None => trial.metres_per_unit(path)?,
        };
        let mut of_marker: Vec<(String, Vec<[f64; 3]>)> = Vec::new();
        for name in table.markers() {
            if of_marker.iter().any(|known| known.0 == name) {
                continue;
            }
            let index = trial.marker(name).ok_or_else(|| MotionError::NoMarker {
                path: path.to_owned(),
                name: name.to_owned(),
                markers: trial.names.clone(),
            })?;
            let seen: Vec<Option<[f64; 3]>> =
                trial.frames.iter().map(|frame| frame[index]).collect();
            let points =
                interpolated(&seen, options.max_gap_s * trial.rate_hz).map_err(|[from, to]| {
                    MotionError::Gap {
                        path: path.to_owned(),
                        marker: name.to_owned(),
                        frames: [from, to].map(|frame| trial.first + frame as u32),
                        seconds: (to - from + 1) as f64 / trial.rate_hz,
                        max_gap_s: options.max_gap_s,
                    }
                })?;
            let upright = points.into_iter().map(|point| table.upright(point));
            let points = upright.map(|point| point.map(|value| value * metres)).collect();
            of_marker.push((name.to_owned(), points));
        }
        Ok(Self { path, of_marker })
    }

    /// A joint in every frame: the weighted sum of its markers.
    fn joint(&self, table: &MarkerTable, joint: &str) -> Result<Vec<[f64; 3]>, MotionError> {
        let no_joint = || MotionError::NoJoint {
            path: self.path.to_owned(),
            joint: joint.to_owned(),
        };
        let weights = table.joint(joint).ok_or_else(no_joint)?;
        let n = self.of_marker.first().map_or(0, |marker| marker.1.len());
        let mut sum = vec![[0.0; 3]; n];
        for (name, weight) in weights {
            let column = self.of_marker.iter().find(|marker| marker.0 == *name);
            let (_, points) = column.ok_or_else(no_joint)?;
            for (into, point) in sum.iter_mut().zip(points) {
                for axis in 0..3 {
                    into[axis] += weight * point[axis];
                }
            }
        }
        Ok(sum)
    }
}

/// Fills the gaps of a marker: linearly between visible frames, constant at the ends.
///
/// # Errors
///
/// Returns the first and last frame of the first gap longer than `longest` frames, or of the whole recording if the marker was never
/// visible.
fn interpolated(seen: &[Option<[f64; 3]>], longest: f64) -> Result<Vec<[f64; 3]>, [usize; 2]> {
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(seen.len());
    while points.len() < seen.len() {
        let begin = points.len();
        if let Some(point) = seen[begin] {
            points.push(point);
            continue;
        }
        let end = seen[begin..].iter().position(Option::is_some);
        let end = end.map_or(seen.len(), |length| begin + length);
        let (before, after) = (points.last().copied(), seen.get(end).copied().flatten());
        let too_long = (end - begin) as f64 > longest + 1e-9;
        let (Some(from), false) = (before.or(after), too_long) else {
            return Err([begin, end - 1]);
        };
        let to = after.unwrap_or(from);
        for nth in begin..end {
            let share = (nth - begin + 1) as f64 / (end - begin + 1) as f64;
            points.push(core::array::from_fn(|axis| {
                from[axis] + share * (to[axis] - from[axis])
            }));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests;
