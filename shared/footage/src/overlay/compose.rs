//! Pictures side by side.

use super::text::{TEXT_HEIGHT, text_width};
use super::{CENTRE, Canvas, Colour};
use crate::Size;

const BACKGROUND: Colour = [24, 24, 24];
const GAP: usize = 8;
const CAPTION: usize = TEXT_HEIGHT + 6;

/// A picture with a caption above it.
#[derive(Debug, Clone, Copy)]
pub struct Tile<'a> {
    /// The picture.
    pub picture: &'a Canvas,
    /// One line of text, truncated to the width of the cell.
    pub caption: &'a str,
}

/// Puts pictures side by side in reading order, `n_columns` in a row, each below its caption.
///
/// All cells are as large as the largest picture. A smaller picture is centred in the width of its cell.
///
/// # Panics
///
/// Panics without a tile or a column.
pub fn compose(tiles: &[Tile<'_>], n_columns: usize) -> Canvas {
    assert!(!tiles.is_empty() && n_columns > 0, "tiles in columns");
    let largest = |side: fn(Size) -> usize| {
        let sides = tiles.iter().map(|tile| side(tile.picture.size()));
        sides.max().unwrap_or(0)
    };
    let cell = Size::new(
        largest(|size| size.width),
        largest(|size| size.height) + CAPTION,
    );
    let n_columns = n_columns.min(tiles.len());
    let n_rows = tiles.len().div_ceil(n_columns);
    let size = Size::new(
        n_columns * (cell.width + GAP) + GAP,
        n_rows * (cell.height + GAP) + GAP,
    );
    let mut sheet = Canvas::new(size, BACKGROUND);
    for (index, tile) in tiles.iter().enumerate() {
        let left = GAP + index % n_columns * (cell.width + GAP);
        let top = GAP + index / n_columns * (cell.height + GAP);
        sheet.text(
            [left as f64, top as f64 + 2.0],
            fitting(tile.caption, cell.width),
            CENTRE,
        );
        let margin = (cell.width - tile.picture.size().width) / 2;
        sheet.put(tile.picture, [left + margin, top + CAPTION]);
    }
    sheet
}

/// Truncates a line to a width.
fn fitting(line: &str, width: usize) -> &str {
    let n_fitting = width / text_width("m");
    line.char_indices().nth(n_fitting).map_or(line, |(end, _)| &line[..end])
}
