//! Parser that converts the text of a file to markers over time.

/// Markers over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trc {
    /// Frames per second.
    pub rate_hz: f64,
    /// Unit of the positions, as the file names it: `m` or `mm`.
    pub units: String,
    /// Names of the markers.
    pub markers: Vec<String>,
    /// Positions as `[frame][marker]`, in the file's own frame of reference and unit; `None` for a missing marker.
    pub frames: Vec<Vec<Option<[f64; 3]>>>,
}

/// Reason why a TRC file was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrcError {
    /// A header line is missing or malformed.
    #[error("line {line}: expected {expected}")]
    Header {
        /// Number of the line, from 1.
        line: usize,
        /// Expected text.
        expected: &'static str,
    },
    /// A row has a different number of columns than the header declares.
    #[error("line {line}: {got} columns, but the header announces {markers} markers")]
    Columns {
        /// Number of the line, from 1.
        line: usize,
        /// Number of columns found.
        got: usize,
        /// Number of markers that the header declares.
        markers: usize,
    },
    /// A cell is not a number.
    #[error("line {line}, column {column}: {text:?} is not a number")]
    Number {
        /// Number of the line, from 1.
        line: usize,
        /// Number of the column, from 1.
        column: usize,
        /// Text of the cell.
        text: String,
    },
}

impl Trc {
    /// Parses the text of a TRC file.
    ///
    /// Empty cells and NaN are missing markers. Rows may end in a tab.
    ///
    /// # Errors
    ///
    /// See [`TrcError`].
    pub fn parse(text: &str) -> Result<Self, TrcError> {
        let lines: Vec<&str> = text.lines().collect();
        let cells = |line: usize, expected: &'static str| {
            let missing = TrcError::Header { line, expected };
            let text = lines.get(line - 1).ok_or(missing)?;
            Ok(text.split('\t').map(str::trim).collect::<Vec<_>>())
        };
        let keys = cells(2, "the names of the header fields")?;
        let values = cells(3, "the values of the header fields")?;
        let field = |name: &str, expected: &'static str| {
            let at = keys.iter().position(|key| *key == name);
            let value = at.and_then(|at| values.get(at)).copied();
            value.ok_or(TrcError::Header { line: 3, expected })
        };
        let rate = field("DataRate", "a DataRate")?;
        let rate_hz = rate.parse().map_err(|_error: std::num::ParseFloatError| {
            let expected = "a number as the DataRate";
            TrcError::Header { line: 3, expected }
        })?;
        let markers: Vec<String> = cells(4, "the names of the markers")?
            .into_iter()
            .skip(2)
            .filter(|cell| !cell.is_empty())
            .map(str::to_owned)
            .collect();
        let frames = lines
            .iter()
            .enumerate()
            .skip(5)
            .filter(|(_, text)| !text.trim().is_empty())
            .map(|(i, text)| row(text, i + 1, markers.len()))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            rate_hz,
            units: field("Units", "a unit")?.to_owned(),
            markers,
            frames,
        })
    }

    /// Returns the index of a marker.
    pub fn marker(&self, name: &str) -> Option<usize> {
        self.markers.iter().position(|marker| marker == name)
    }
}

fn row(text: &str, line: usize, markers: usize) -> Result<Vec<Option<[f64; 3]>>, TrcError> {
    let mut cells: Vec<&str> = text.split('\t').map(str::trim).collect();
    while cells.len() > 2 + 3 * markers && cells.last().is_some_and(|cell| cell.is_empty()) {
        cells.pop();
    }
    if cells.len() != 2 + 3 * markers {
        let got = cells.len();
        return Err(TrcError::Columns { line, got, markers });
    }
    let number = |column: usize| -> Result<f64, TrcError> {
        let text = cells[column];
        if text.is_empty() {
            return Ok(f64::NAN);
        }
        let column = column + 1;
        text.parse().map_err(|_error: std::num::ParseFloatError| TrcError::Number {
            line,
            column,
            text: text.to_owned(),
        })
    };
    (0..markers)
        .map(|marker| {
            let at = 2 + 3 * marker;
            let point = [number(at)?, number(at + 1)?, number(at + 2)?];
            Ok(point.iter().all(|value| value.is_finite()).then_some(point))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const FILE: &str = "PathFileType\t4\t(X/Y/Z)\tx.trc\n\
        DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n\
        60\t60\t2\t2\tm\n\
        Frame#\tTime\tHip\t\t\tHead\t\t\t\n\
        \t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\
        1\t0.0\t1\t2\t3\t4\t5\t6\n\
        2\t0.1\t\t\t\t4\t5\t7\t\n";

    #[test]
    fn markers_are_read_and_empty_cells_are_missing() {
        let got = Trc::parse(FILE).expect("a good file");
        assert_eq!(got.markers, ["Hip", "Head"]);
        assert_eq!((got.rate_hz, got.units.as_str()), (60.0, "m"));
        assert_eq!(got.frames[0][0], Some([1.0, 2.0, 3.0]));
        assert_eq!(got.frames[1], [None, Some([4.0, 5.0, 7.0])]);
    }

    #[test]
    fn the_error_for_an_empty_file_names_what_is_missing() {
        let got = Trc::parse("");
        assert!(
            matches!(got, Err(TrcError::Header { line: 2, .. })),
            "{got:?}"
        );
    }

    #[test]
    fn a_short_row_is_named() {
        let got = Trc::parse(&FILE.replace("\t6\n", "\n"));
        let (line, got_columns) = (6, 7);
        assert_eq!(
            got,
            Err(TrcError::Columns {
                line,
                got: got_columns,
                markers: 2
            })
        );
    }

    #[test]
    fn a_text_among_numbers_is_named() {
        let got = Trc::parse(&FILE.replace("\t5\t6", "\tfive\t6"));
        let text = "five".to_owned();
        let (line, column) = (6, 7);
        assert_eq!(got, Err(TrcError::Number { line, column, text }));
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[\\PC\t\n]{0,300}") {
            drop(Trc::parse(&text));
        }

        #[test]
        fn a_changed_file_is_refused_or_has_rows_of_one_length(
            at in 0..FILE.len(),
            n in 0_usize..4,
            to in "[0-9a-z.\t\n-]{0,4}",
        ) {
            let mut text = FILE.to_owned();
            text.replace_range(at..(at + n).min(FILE.len()), &to);
            if let Ok(trc) = Trc::parse(&text) {
                prop_assert!(trc.frames.iter().all(|frame| frame.len() == trc.markers.len()));
                let mut sides = trc.frames.iter().flatten().flatten().flatten();
                prop_assert!(sides.all(|side| side.is_finite()));
            }
        }
    }
}
