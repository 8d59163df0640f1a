//! Board described by one line of text.

use core::fmt;
use core::str::FromStr;

use calib_targets_aruco::{Dictionary, builtins};

/// Maximum number of squares or markers along a side.
const MOST: usize = 100;
/// Default dictionary of a `ChArUco` board.
const USUAL_MARKERS: &str = "DICT_4X4_1000";
/// Default dictionary of an `AprilTag` grid.
const USUAL_TAGS: &str = "DICT_APRILTAG_36h11";

/// Pattern of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Black and white squares; the numbers of columns and rows are those of the inner corners.
    Chessboard,
    /// Black and white squares with a marker in each white one; the numbers of columns and rows are those of the squares.
    Charuco,
    /// Markers side by side; the numbers of columns and rows are those of the markers.
    Grid,
}

/// A calibration board.
///
/// Its text form is `charuco:7x5:40mm`, `chessboard:9x6:25mm` or `aprilgrid:6x6:88mm`, with options after further colons.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Pattern of the board.
    pub kind: Kind,
    /// Number of squares (`ChArUco`), inner corners (chessboard) or markers (grid) from left to right.
    pub columns: usize,
    /// Number of squares, inner corners or markers from top to bottom.
    pub rows: usize,
    /// Side of a square, or of a marker of a grid, in metres.
    pub square_metres: f64,
    /// For `ChArUco`, the side of a marker relative to that of a square; for a grid, the gap between markers relative to their side.
    pub ratio: f64,
    /// Name of the dictionary; `None` for a chessboard.
    pub dictionary: Option<&'static str>,
    /// True for a `ChArUco` board as `OpenCV` before 4.6 drew it: if the number of rows is even, the upper left square is white.
    pub is_legacy: bool,
}

/// Reason why a text does not describe a board.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// The text has too few parts, or an unknown kind.
    #[error(
        "{text:?} is not a board: expected KIND:COLUMNSxROWS:SIDE such as charuco:7x5:40mm (squares), chessboard:9x6:25mm (inner corners) or aprilgrid:6x6:88mm (tags)"
    )]
    Shape {
        /// The text that was given.
        text: String,
    },
    /// The numbers of columns and rows are out of range.
    #[error("the board is {columns}x{rows}, but it must have 2 to {limit} squares, corners or tags along each side", limit = MOST)]
    Counts {
        /// Number of columns.
        columns: usize,
        /// Number of rows.
        rows: usize,
    },
    /// A part of the text is not a length.
    #[error(
        "{text:?} is not a length: expected a number above 0 with mm, cm, m or in, such as 40mm"
    )]
    Length {
        /// The part of the text.
        text: String,
    },
    /// An option is unknown or invalid.
    #[error("{text:?}: {expected}")]
    Option {
        /// The option.
        text: String,
        /// Accepted values.
        expected: &'static str,
    },
    /// The dictionary does not exist.
    #[error("{text:?} is not a dictionary: expected one of {}", dictionary_names().collect::<Vec<_>>().join(", "))]
    Dictionary {
        /// The name that was given.
        text: String,
    },
    /// The board has more markers than the dictionary.
    #[error(
        "the board needs {needed} markers, but the dictionary {dictionary} has only {available}"
    )]
    TooFewMarkers {
        /// Number of markers on the board.
        needed: usize,
        /// Name of the dictionary.
        dictionary: &'static str,
        /// Number of markers in the dictionary.
        available: usize,
    },
}

/// Returns the short names of all dictionaries, such as `4x4_50` and `apriltag_36h11`.
pub fn dictionary_names() -> impl Iterator<Item = String> {
    builtins::BUILTIN_DICTIONARY_NAMES.iter().map(|name| short(name))
}

fn short(name: &str) -> String {
    name.trim_start_matches("DICT_").to_ascii_lowercase()
}

fn dictionary_named(text: &str) -> Result<&'static str, BoardError> {
    let wanted = short(&text.to_ascii_uppercase());
    let mut names = builtins::BUILTIN_DICTIONARY_NAMES.iter();
    let found = names.find(|name| {
        let name = short(name);
        name == wanted || name == format!("apriltag_{wanted}")
    });
    found.copied().ok_or_else(|| BoardError::Dictionary {
        text: text.to_owned(),
    })
}

impl Board {
    /// Returns the codes of the board's markers; `None` for a chessboard.
    pub fn codes(&self) -> Option<Dictionary> {
        builtins::builtin_dictionary(self.dictionary?)
    }

    /// Returns the board with columns and rows swapped.
    #[must_use]
    pub fn turned(&self) -> Self {
        Self {
            columns: self.rows,
            rows: self.columns,
            ..self.clone()
        }
    }

    /// Returns the width and height of the pattern in metres, without the margin.
    pub fn size_metres(&self) -> [f64; 2] {
        let side = |count: usize| match self.kind {
            Kind::Charuco => count as f64 * self.square_metres,
            Kind::Chessboard => (count + 1) as f64 * self.square_metres,
            Kind::Grid => {
                let count = count as f64;
                (count + (count + 1.0) * self.ratio) * self.square_metres
            }
        };
        [side(self.columns), side(self.rows)]
    }

    /// Returns the number of markers.
    pub fn n_markers(&self) -> usize {
        match self.kind {
            Kind::Chessboard => 0,
            // Half of the squares have a marker. The upper left square is black, except on a legacy board with an even number of rows.
            Kind::Charuco => {
                let squares = self.columns * self.rows;
                let is_white_first = self.is_legacy && self.rows.is_multiple_of(2);
                if is_white_first {
                    squares.div_ceil(2)
                } else {
                    squares / 2
                }
            }
            Kind::Grid => self.columns * self.rows,
        }
    }

    fn check(&self) -> Result<(), BoardError> {
        let (columns, rows) = (self.columns, self.rows);
        let least = if self.kind == Kind::Grid { 1 } else { 2 };
        if columns.min(rows) < least || columns.max(rows) < 2 || columns.max(rows) > MOST {
            return Err(BoardError::Counts { columns, rows });
        }
        let (Some(codes), Some(dictionary)) = (self.codes(), self.dictionary) else {
            return Ok(());
        };
        let (needed, available) = (self.n_markers(), codes.codes().len());
        if needed > available {
            return Err(BoardError::TooFewMarkers {
                needed,
                dictionary,
                available,
            });
        }
        Ok(())
    }

    fn set(&mut self, option: &str) -> Result<(), BoardError> {
        let expected = match self.kind {
            Kind::Chessboard => "a chessboard accepts no options",
            Kind::Charuco => {
                "the options of a ChArUco board are a dictionary such as 5x5_100, the marker's side (marker=0.75 of the square, or \
                 marker=30mm), and legacy"
            }
            Kind::Grid => {
                "the options of a grid are a dictionary such as 36h11, and the gap between tags (gap=0.3 of the tag, or gap=26mm)"
            }
        };
        let invalid = || BoardError::Option {
            text: option.to_owned(),
            expected,
        };
        if self.kind == Kind::Chessboard {
            return Err(invalid());
        }
        let key = if self.kind == Kind::Charuco {
            "marker"
        } else {
            "gap"
        };
        match option.split_once('=') {
            Some((name, value)) if name == key => {
                let share = match value.parse::<f64>() {
                    Ok(share) => share,
                    Err(_) => length(value)? / self.square_metres,
                };
                let limit = if key == "marker" { 0.99 } else { 5.0 };
                if !(0.05..=limit).contains(&share) {
                    return Err(invalid());
                }
                self.ratio = share;
            }
            Some(_) => return Err(invalid()),
            None if option == "legacy" && self.kind == Kind::Charuco => self.is_legacy = true,
            None => self.dictionary = Some(dictionary_named(option)?),
        }
        Ok(())
    }
}

/// Parses a length and returns it in metres.
fn length(text: &str) -> Result<f64, BoardError> {
    let invalid = || BoardError::Length {
        text: text.to_owned(),
    };
    let units = [("mm", 1e3), ("cm", 1e2), ("in", 1.0 / 0.0254), ("m", 1.0)];
    let unit = units.iter().find_map(|(name, per_metre)| {
        text.strip_suffix(name).map(|number| (number.trim(), *per_metre))
    });
    let (number, per_metre) = unit.ok_or_else(invalid)?;
    let value = number.parse::<f64>().map_err(|_not_a_number| invalid())? / per_metre;
    // Rounded so that 1 in equals 25.4 mm.
    let value = (value * 1e12).round() / 1e12;
    if value.is_finite() && (1e-5..1e3).contains(&value) {
        Ok(value)
    } else {
        Err(invalid())
    }
}

impl FromStr for Board {
    type Err = BoardError;

    fn from_str(text: &str) -> Result<Self, BoardError> {
        let shape = || BoardError::Shape {
            text: text.to_owned(),
        };
        let mut parts = text.split(':').map(str::trim);
        let (kind, ratio, dictionary) = match parts.next() {
            Some("chessboard" | "chess" | "checkerboard") => (Kind::Chessboard, 0.0, None),
            Some("charuco") => (Kind::Charuco, 0.75, Some(USUAL_MARKERS)),
            Some("aprilgrid" | "apriltag" | "grid") => (Kind::Grid, 0.3, Some(USUAL_TAGS)),
            _ => return Err(shape()),
        };
        let counts = parts.next().and_then(|part| part.split_once(['x', 'X']));
        let (columns, rows) = counts.ok_or_else(shape)?;
        let count = |text: &str| text.trim().parse::<usize>().map_err(|_not_a_count| shape());
        let mut board = Self {
            kind,
            columns: count(columns)?,
            rows: count(rows)?,
            square_metres: length(parts.next().ok_or_else(shape)?)?,
            ratio,
            dictionary,
            is_legacy: false,
        };
        parts.try_for_each(|option| board.set(option))?;
        board.check()?;
        Ok(board)
    }
}

impl fmt::Display for Board {
    /// Writes the text form of the board, with every option.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Kind::Chessboard => "chessboard",
            Kind::Charuco => "charuco",
            Kind::Grid => "aprilgrid",
        };
        let millimetres = rounded(1e3 * self.square_metres);
        write!(out, "{kind}:{}x{}:{millimetres}mm", self.columns, self.rows)?;
        if let Some(dictionary) = self.dictionary {
            write!(out, ":{}", short(dictionary))?;
            let key = if self.kind == Kind::Charuco {
                "marker"
            } else {
                "gap"
            };
            write!(out, ":{key}={}", rounded(self.ratio))?;
        }
        if self.is_legacy {
            write!(out, ":legacy")?;
        }
        Ok(())
    }
}

/// Rounds to a millionth, for text.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_parsed_from_a_line_of_text_and_written_back() {
        for (text, written) in [
            ("charuco:7x5:40mm", "charuco:7x5:40mm:4x4_1000:marker=0.75"),
            (
                "charuco:4x6:5.4cm:DICT_5X5_250:marker=27mm:legacy",
                "charuco:4x6:54mm:5x5_250:marker=0.5:legacy",
            ),
            ("chessboard:9x6:1in", "chessboard:9x6:25.4mm"),
            (
                "aprilgrid:6x6:88mm",
                "aprilgrid:6x6:88mm:apriltag_36h11:gap=0.3",
            ),
            (
                "aprilgrid:2x1:0.1m:16h5:gap=20mm",
                "aprilgrid:2x1:100mm:apriltag_16h5:gap=0.2",
            ),
        ] {
            let board: Board = text.parse().unwrap();
            assert_eq!(board.to_string(), written);
            let again: Board = written.parse().unwrap();
            assert_eq!(again.to_string(), written);
        }
    }

    #[test]
    fn an_invalid_board_is_refused_with_the_expected_form() {
        for (text, said) in [
            ("", "is not a board"),
            ("charuco:7:40mm", "is not a board"),
            ("charuco:7x5", "is not a board"),
            ("charuco:7x5:40", "is not a length"),
            ("charuco:7x5:-1mm", "is not a length"),
            ("charuco:7x5:NaNmm", "is not a length"),
            ("charuco:1x5:40mm", "1x5"),
            ("charuco:7x5:40mm:9x9_50", "is not a dictionary"),
            ("charuco:99x99:40mm", "needs 4900 markers"),
            ("chessboard:9x6:25mm:4x4_50", "no options"),
            ("charuco:7x5:40mm:marker=2", "marker=0.75"),
        ] {
            let error = text.parse::<Board>().unwrap_err().to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn every_parsed_board_survives_a_round_trip() {
        let seeds = [
            "charuco:7x5:40mm:5x5_100:marker=30mm:legacy",
            "aprilgrid:6x6:88mm:36h11:gap=0.3",
        ];
        let mut random = fastrand::Rng::with_seed(11);
        for nth in 0..20_000 {
            let mut text: Vec<char> = seeds[nth % 2].chars().collect();
            for _ in 0..random.usize(1..4) {
                let at = random.usize(0..text.len());
                text[at] =
                    *random.choice(&['0', '9', ':', 'x', '.', '-', 'e', '\u{e9}', ' ']).unwrap();
            }
            let text: String = text.into_iter().collect();
            if let Ok(board) = text.parse::<Board>() {
                let again = board.to_string().parse::<Board>().unwrap();
                assert!((again.ratio - board.ratio).abs() < 1e-5, "{text}");
                assert_eq!([again.columns, again.rows], [board.columns, board.rows]);
                assert!(crate::boards::Layout::of(&board).points.len() < 50_000);
            }
        }
    }
}
