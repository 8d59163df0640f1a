//! Assignment of pictures to frames: pictures of different cameras with the same frame were taken at the same time.

use std::collections::BTreeMap;
use std::path::Path;

use super::corners::without_fraction;
use failure::{ExitKind, Failure, OrFail as _};

/// Maximum number of rows of a table.
const MOST_ROWS: usize = 10_000_000;

/// For each camera of a table, the frame of its n-th picture.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FrameTable {
    frames: BTreeMap<String, Vec<usize>>,
}

impl FrameTable {
    /// Returns the frames of a camera. The table lists the camera by its name, or by the number at the end of its name.
    pub fn of(&self, camera: &str) -> Option<&[usize]> {
        let digits =
            camera.len() - camera.trim_end_matches(|letter: char| letter.is_ascii_digit()).len();
        let number = &camera[camera.len() - digits..];
        let found = self.frames.get(camera).or_else(|| self.frames.get(number));
        found.map(Vec::as_slice)
    }

    /// Returns the cameras of the table.
    pub fn cameras(&self) -> impl Iterator<Item = &str> {
        self.frames.keys().map(String::as_str)
    }
}

/// Reads a table with the columns `sync_index` and `cam_id`, as Caliscope writes it. The n-th row of a camera belongs to the n-th
/// picture of its video.
///
/// # Errors
///
/// Fails if the file cannot be read, lacks these columns, or has a row without whole numbers.
pub fn read_frames(path: &Path) -> Result<FrameTable, Failure> {
    let text = failure::read_text(path)?;
    table(&text)
        .map_err(|error| Failure::new(ExitKind::Input, format!("{}: {error}", path.display())))
}

fn table(text: &str) -> Result<FrameTable, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |names: &[&str]| {
        let found = header.iter().position(|title| names.contains(&title.trim()));
        found.ok_or_else(|| {
            format!(
                "the column {} is missing: expected sync_index and cam_id",
                names[0]
            )
        })
    };
    let (sync, camera) = (column(&["sync_index"])?, column(&["cam_id", "port"])?);
    let mut frames: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (nth, row) in reader.records().take(MOST_ROWS).enumerate() {
        let row = row.map_err(|error| error.to_string())?;
        let cell = |column: usize| row.get(column).unwrap_or_default().trim();
        let frame = without_fraction(cell(sync)).parse::<usize>();
        let frame = frame
            .map_err(|error| format!("row {}: sync_index {:?}: {error}", nth + 2, cell(sync)))?;
        frames.entry(without_fraction(cell(camera)).to_owned()).or_default().push(frame);
    }
    // Pictures of a video are ordered by time, but the rows may be in any order.
    for list in frames.values_mut() {
        list.sort_unstable();
    }
    Ok(FrameTable { frames })
}

/// Returns the frame of a picture if there is no table. If the frame rates differ, this is the picture's time in units of the slowest
/// camera's frame interval. Otherwise, it is the picture's number.
pub(crate) fn by_clock(index: u64, time_s: Option<f64>, slowest_hz: Option<f64>) -> usize {
    match (time_s, slowest_hz) {
        (Some(time_s), Some(rate_hz)) => (time_s * rate_hz).round().max(0.0) as usize,
        _ => index as usize,
    }
}

/// Returns the lowest frame rate, if all rates are known and not all are equal.
pub(crate) fn slowest(rates_hz: &[Option<f64>]) -> Option<f64> {
    let known: Option<Vec<f64>> = rates_hz.iter().copied().collect();
    let known = known.filter(|rates| rates.len() > 1)?;
    let least = known.iter().copied().fold(f64::MAX, f64::min);
    let most = known.iter().copied().fold(0.0, f64::max);
    (most > 1.001 * least).then_some(least)
}

/// Reads the table in the folder of the first camera's file, if there is one.
///
/// # Errors
///
/// Fails like [`read_frames`].
pub(crate) fn beside(path: &str) -> Result<Option<FrameTable>, Failure> {
    let table = Path::new(path).with_file_name("timestamps.csv");
    if !table.is_file() {
        return Ok(None);
    }
    let text = files::read_text(&table, files::SETTINGS).or_fail(ExitKind::Input)?;
    // A table with other columns is ignored: another program wrote it.
    Ok(self::table(&text).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nth_row_of_a_camera_belongs_to_its_nth_picture() {
        let text = "sync_index,cam_id,frame_time\n35,2,25.0\n35,3,25.1\n36,2,25.2\n38,2,25.5\n";
        let table = table(text).unwrap();
        assert_eq!(table.of("cam_2"), Some(&[35, 36, 38][..]));
        assert_eq!(table.of("3"), Some(&[35][..]));
        assert_eq!(table.of("cam_1"), None);
        let floats = super::table("sync_index,cam_id\n35.0,2.0\n").unwrap();
        assert_eq!(floats.cameras().collect::<Vec<_>>(), ["2"]);
        for wrong in ["", "a,b\n1,2\n", "sync_index,cam_id\nx,0\n"] {
            assert!(self::table(wrong).is_err(), "{wrong:?}");
        }
    }
}
