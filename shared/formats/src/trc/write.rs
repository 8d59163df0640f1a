//! Writer that converts markers over time to the text of a file, row by row.

use core::fmt::{self, Write as _};

/// The five lines before the rows; [`Display`](fmt::Display) writes them.
///
/// ```
/// let heading = formats::trc::Heading {
///     file_name: "walk.trc",
///     rate_hz: 60.0,
///     units: "m",
///     markers: &["hip", "head"],
///     n_rows: 1,
/// };
/// let points = [Some([0.0, 1.0, 0.0]), None];
/// let text = format!("{heading}{}", formats::trc::row(1, 0.0, points));
/// let read = formats::trc::Trc::parse(&text).unwrap();
/// assert_eq!(read.frames[0], points);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading<'a> {
    /// Name of the file itself.
    pub file_name: &'a str,
    /// Frames per second.
    pub rate_hz: f64,
    /// Unit of the positions: `m` or `mm`.
    pub units: &'a str,
    /// Names of the markers, without tabs.
    pub markers: &'a [&'a str],
    /// Number of rows that follow.
    pub n_rows: u64,
}

impl fmt::Display for Heading<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rate, n_rows, n) = (self.rate_hz, self.n_rows, self.markers.len());
        let (name, units) = (self.file_name, self.units);
        let markers = self.markers.join("\t\t\t");
        let axes: Vec<String> = (1..=n).map(|i| format!("X{i}\tY{i}\tZ{i}")).collect();
        let axes = axes.join("\t");
        write!(
            out,
            "PathFileType\t4\t(X/Y/Z)\t{name}\n\
             DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n\
             {rate}\t{rate}\t{n_rows}\t{n}\t{units}\t{rate}\t1\t{n_rows}\n\
             Frame#\tTime\t{markers}\t\t\n\
             \t\t{axes}\n"
        )
    }
}

/// Returns one row with its line break. The three cells of a missing marker are `NaN`, not empty: `OpenSim` (4.6) drops an empty cell after
/// the last tab of a line, and then refuses the row.
///
/// * `number`: number of the row, from 1.
/// * `markers`: positions in the file's unit.
pub fn row(
    number: u64,
    time_s: f64,
    markers: impl IntoIterator<Item = Option<[f64; 3]>>,
) -> String {
    let mut text = format!("{number}\t{time_s:.6}");
    for marker in markers {
        if let Some([x, y, z]) = marker {
            // Writing to a string cannot fail.
            let _infallible = write!(text, "\t{x:.6}\t{y:.6}\t{z:.6}");
        } else {
            text.push_str("\tNaN\tNaN\tNaN");
        }
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::trc::Trc;

    #[test]
    fn every_row_has_all_cells_even_if_values_are_missing() {
        for points in [[None; 3], [Some([1.0; 3]), Some([2.0; 3]), None]] {
            let text = row(7, 0.1, points);
            let cells: Vec<&str> = text.trim_end_matches('\n').split('\t').collect();
            assert_eq!(cells.len(), 2 + 3 * 3);
            assert!(cells.iter().all(|cell| !cell.is_empty()), "{text:?}");
            assert_eq!(cells[8..], ["NaN"; 3]);
        }
    }

    proptest! {
        #[test]
        fn written_values_are_read_back_to_a_millionth(
            frames in prop::collection::vec(
                prop::collection::vec(prop::option::of(prop::array::uniform3(-1e3..1e3_f64)), 3),
                0..5,
            ),
        ) {
            let heading = Heading {
                file_name: "a.trc",
                rate_hz: 29.97,
                units: "mm",
                markers: &["a", "b", "c"],
                n_rows: frames.len() as u64,
            };
            let mut text = heading.to_string();
            for (number, markers) in (1..).zip(&frames) {
                text += &row(number, number as f64 / 29.97, markers.iter().copied());
            }
            let read = Trc::parse(&text).unwrap();
            prop_assert_eq!((read.rate_hz, &read.units[..]), (29.97, "mm"));
            prop_assert_eq!(&read.markers, &["a", "b", "c"]);
            prop_assert_eq!(read.frames.len(), frames.len());
            for (read, written) in read.frames.iter().flatten().zip(frames.iter().flatten()) {
                prop_assert_eq!(read.is_some(), written.is_some());
                if let Some((read, written)) = read.zip(*written) {
                    let is_near = |axis: usize| (read[axis] - written[axis]).abs() < 1e-6;
                    prop_assert!((0..3).all(is_near), "{:?} {:?}", read, written);
                }
            }
        }
    }
}
