//! Drawing of a board on a page: rectangles, lines and text in millimetres.

use core::str::FromStr;

use nalgebra::Point2;

use crate::boards::layout::is_black;
use crate::boards::{Board, Kind, Layout};

/// White margin around the board, and space for the ruler and the text below it, in millimetres.
const MARGIN: f64 = 8.0;
const FOOT: f64 = 20.0;

/// A shape of a drawing, in millimetres from the upper left corner of the page, with y down.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled rectangle.
    Rectangle {
        /// Upper left corner of the rectangle.
        at: [f64; 2],
        /// Width and height.
        size: [f64; 2],
        /// True if the rectangle is black; otherwise it is white on black.
        is_black: bool,
    },
    /// Text in black.
    Text {
        /// Start of the baseline.
        at: [f64; 2],
        /// Height of the letters.
        size: f64,
        /// The text, in ASCII.
        text: String,
    },
}

/// A page to print.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Width and height of the page, millimetres.
    pub page: [f64; 2],
    /// Position of the board's upper left corner on the page.
    pub board_at: [f64; 2],
    /// Shapes on the page; later shapes cover earlier ones.
    pub shapes: Vec<Shape>,
}

/// Size of the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Paper {
    /// The smallest paper size from A4 to A0 on which the board fits, in portrait or landscape. If the board fits on none, the page is as
    /// large as the board needs.
    Fitting,
    /// A width and height in millimetres. The page is rotated if the board fits only in that way.
    Sized([f64; 2]),
}

/// Reason why a board cannot be drawn on a page.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PaperError {
    /// The page is too small for the board.
    #[error(
        "the board with its margin and ruler needs {:.0} x {:.0} mm, but the page is {:.0} x {:.0} mm: choose smaller squares or a larger \
         page",
        .needed[0], .needed[1], .page[0], .page[1]
    )]
    TooSmall {
        /// Size that the board needs, in millimetres.
        needed: [f64; 2],
        /// Size of the page, in millimetres.
        page: [f64; 2],
    },
    /// The text is not the name of a page.
    #[error(
        "{text:?} is not a page: expected a4, a3, a2, a1, a0, letter, legal, tabloid, fit or WIDTHxHEIGHT in mm"
    )]
    Unknown {
        /// The text that was given.
        text: String,
    },
}

const PAPERS: [(&str, [f64; 2]); 8] = [
    ("a4", [210.0, 297.0]),
    ("a3", [297.0, 420.0]),
    ("a2", [420.0, 594.0]),
    ("a1", [594.0, 841.0]),
    ("a0", [841.0, 1189.0]),
    ("letter", [215.9, 279.4]),
    ("legal", [215.9, 355.6]),
    ("tabloid", [279.4, 431.8]),
];

impl FromStr for Paper {
    type Err = PaperError;

    fn from_str(text: &str) -> Result<Self, PaperError> {
        let name = text.trim().to_ascii_lowercase();
        if name == "fit" {
            return Ok(Self::Fitting);
        }
        if let Some((_, size)) = PAPERS.iter().find(|(known, _)| *known == name) {
            return Ok(Self::Sized(*size));
        }
        let sides = name.trim_end_matches("mm").split_once('x');
        let side = |text: &str| text.trim().trim_end_matches("mm").parse::<f64>().ok();
        let size = sides.and_then(|(width, height)| Some([side(width)?, side(height)?]));
        match size {
            Some(size) if size.iter().all(|side| (20.0..=5000.0).contains(side)) => {
                Ok(Self::Sized(size))
            }
            _ => Err(PaperError::Unknown {
                text: text.to_owned(),
            }),
        }
    }
}

impl Drawing {
    /// Returns the name of the page in the form from which [`Paper`] is parsed; `None` if the page has no name.
    pub fn paper(&self) -> Option<&'static str> {
        let [width, height] = self.page;
        let is_page = |size: &[f64; 2]| *size == [width, height] || *size == [height, width];
        let found = PAPERS.iter().find(|(_, size)| is_page(size));
        found.map(|(name, _)| *name)
    }

    /// Draws a board in its true size on a page, with a ruler and its description below.
    ///
    /// # Errors
    ///
    /// Fails with [`PaperError::TooSmall`].
    pub fn new(board: &Board, paper: Paper) -> Result<Self, PaperError> {
        let size = board.size_metres().map(|value| 1e3 * value);
        let needed = [size[0] + 2.0 * MARGIN, size[1] + 2.0 * MARGIN + FOOT];
        let page = page_for(needed, paper)?;
        let board_at = [0.5 * (page[0] - size[0]), 0.5 * (page[1] - size[1] - FOOT)];
        let mut drawing = Self {
            page,
            board_at,
            shapes: Vec::new(),
        };
        drawing.squares(board);
        drawing.markers(board);
        drawing.foot(board, size);
        Ok(drawing)
    }

    fn rectangle(&mut self, at: [f64; 2], size: [f64; 2], is_black: bool) {
        self.shapes.push(Shape::Rectangle { at, size, is_black });
    }

    fn squares(&mut self, board: &Board) {
        let more = match board.kind {
            Kind::Grid => return,
            Kind::Chessboard => 1,
            Kind::Charuco => 0,
        };
        let side = 1e3 * board.square_metres;
        for row in 0..board.rows + more {
            for column in 0..board.columns + more {
                if is_black(board, column, row) {
                    let at = [
                        self.board_at[0] + column as f64 * side,
                        self.board_at[1] + row as f64 * side,
                    ];
                    self.rectangle(at, [side; 2], true);
                }
            }
        }
    }

    fn markers(&mut self, board: &Board) {
        let Some(codes) = board.codes() else {
            return;
        };
        let cells = codes.marker_size();
        for marker in Layout::of(board).markers {
            let [first, _, last, _] = marker.corners;
            let side = 1e3 * (last.x - first.x);
            let place = |point: Point2<f64>| {
                [
                    self.board_at[0] + 1e3 * point.x,
                    self.board_at[1] + 1e3 * point.y,
                ]
            };
            let at = place(first);
            self.rectangle(at, [side; 2], true);
            let cell = side / (cells + 2) as f64;
            let code = codes.codes()[marker.id];
            for row in 0..cells {
                let is_white = |column: usize| (code >> (row * cells + column)) & 1 == 0;
                let mut column = 0;
                // Adjacent white cells form one rectangle, to avoid hairlines between them.
                while column < cells {
                    let run = (column..cells).take_while(|i| is_white(*i)).count();
                    if run > 0 {
                        let corner = [
                            at[0] + (column + 1) as f64 * cell,
                            at[1] + (row + 1) as f64 * cell,
                        ];
                        self.rectangle(corner, [run as f64 * cell, cell], false);
                    }
                    column += run.max(1);
                }
            }
        }
    }

    /// Adds a ruler of whole centimetres, and the description of the board.
    fn foot(&mut self, board: &Board, size: [f64; 2]) {
        let left = self.board_at[0];
        let top = self.board_at[1] + size[1] + MARGIN;
        let tens = (size[0] / 10.0).floor().clamp(1.0, 20.0);
        self.rectangle([left, top], [10.0 * tens, 0.4], true);
        for ten in 0..=tens as u32 {
            let height = if ten.is_multiple_of(5) { 4.0 } else { 2.5 };
            let at = [left + 10.0 * f64::from(ten) - 0.1, top];
            self.rectangle(at, [0.2, height], true);
        }
        let length = 10.0 * tens;
        for (line, text) in [
            format!(
                "this line must measure {length:.0} mm: print at 100 %, without fitting to the page"
            ),
            format!("Parallax  {board}"),
        ]
        .into_iter()
        .enumerate()
        {
            let at = [left, top + 8.0 + 4.5 * line as f64];
            self.shapes.push(Shape::Text {
                at,
                size: 3.0,
                text,
            });
        }
    }
}

fn page_for(needed: [f64; 2], paper: Paper) -> Result<[f64; 2], PaperError> {
    let fits = |page: [f64; 2]| page[0] >= needed[0] && page[1] >= needed[1];
    let either_way =
        |size: [f64; 2]| [size, [size[1], size[0]]].into_iter().find(|page| fits(*page));
    match paper {
        Paper::Fitting => {
            let found = PAPERS[..5].iter().find_map(|(_, size)| either_way(*size));
            Ok(found.unwrap_or(needed))
        }
        Paper::Sized(page) => either_way(page).ok_or(PaperError::TooSmall { needed, page }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_page_that_fits_is_taken() {
        let board = |text: &str| text.parse::<Board>().unwrap();
        let page =
            |text: &str, paper| Drawing::new(&board(text), paper).map(|drawing| drawing.page);
        let fitting = Paper::Fitting;
        assert_eq!(page("charuco:5x7:30mm", fitting), Ok([210.0, 297.0]));
        assert_eq!(page("charuco:7x5:38mm", fitting), Ok([297.0, 420.0]));
        assert_eq!(page("charuco:7x5:34mm", fitting), Ok([297.0, 210.0]));
        assert!(page("charuco:9x9:1m", fitting).unwrap()[0] > 9000.0);
        let name = |text: &str| Drawing::new(&board(text), fitting).unwrap().paper();
        assert_eq!(name("charuco:7x5:38mm"), Some("a3"));
        assert_eq!(name("charuco:9x9:1m"), None);
        let error = page("charuco:7x5:40mm", "letter".parse().unwrap()).unwrap_err();
        assert!(error.to_string().contains("296 x 236 mm"), "{error}");
        "b7".parse::<Paper>().unwrap_err();
        assert_eq!("300x400mm".parse(), Ok(Paper::Sized([300.0, 400.0])));
    }
}
