//! Calibration boards: their patterns, their printing, and their detection in pictures.
//!
//! | step | where |
//! |---|---|
//! | a board in one line of text, its points and markers in metres | `board`, `layout` |
//! | a board as a drawing, SVG, PDF or pixels | `drawing`, `svg`, `pdf` |
//! | dark quadrilaterals, and the markers in them | `picture`, `threshold`, `quads`, `marker` |
//! | the layout that several markers agree on, and all corners that follow from it | `fit`, `grow` |
//! | chessboards without markers | `chess` |
//! | corners with sub-pixel precision | `corner` |
//!
//! The coordinate system of a board is in metres. Its origin is the upper left corner as printed; x points right, y points down, and z
//! points away from the viewer. Pixel coordinates are the same as in all other crates: the centre of the upper left pixel is (0, 0). This
//! module uses no clock, file or thread.

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
