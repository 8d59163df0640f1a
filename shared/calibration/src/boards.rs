//! Boards to calibrate cameras with: what is on them, how they are printed, where they are in a picture.
//!
//! | step | where |
//! |---|---|
//! | a board in one line of text, its points and markers in metres | `board`, `layout` |
//! | the same as a drawing, SVG, PDF or pixels | `drawing`, `svg`, `pdf` |
//! | dark quadrilaterals, markers read from them | `picture`, `threshold`, `quads`, `marker` |
//! | the layout that several markers agree on, and every corner that follows from it | `fit`, `grow` |
//! | chessboards without markers | `chess` |
//! | a corner to a fraction of a pixel | `corner` |
//!
//! The frame of a board: metres, origin at its upper left corner as printed, x to the right, y down, z away from who
//! looks at it. Pixels as everywhere: the centre of the upper left one is (0, 0). Pure: no clock, file or thread.

mod board;
mod layout;

mod drawing;
mod pdf;
mod svg;

mod picture;

mod homography;

mod quads;
mod threshold;

mod marker;

mod corner;
mod seen;

mod fit;
mod grow;

mod chess;

mod find;

#[cfg(test)]
mod tests;

pub use board::{Board, BoardError, Kind, dictionary_names};
pub use drawing::{Drawing, Paper, PaperError, Shape};
pub use find::{Finder, Found, Hints};
pub use homography::Homography;
pub use layout::{Layout, Marker};
pub use pdf::pdf;
pub use picture::Picture;
pub use seen::{Corner, Nothing};
pub use svg::svg;
