//! Anti-aliased text.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::{Canvas, Colour, SHADOW};

const SIZE: RasterHeight = RasterHeight::Size16;
const WEIGHT: FontWeight = FontWeight::Regular;

/// Height of a line of text, in pixels.
pub const TEXT_HEIGHT: usize = 16;

/// Returns the width of a line of text, in pixels.
pub fn text_width(text: &str) -> usize {
    text.chars().count() * get_raster_width(WEIGHT, SIZE)
}

impl Canvas {
    /// Draws one line of text with a dark edge, with its top-left corner at `at`. Characters that are not ASCII become
    /// question marks.
    pub fn text(&mut self, at: [f64; 2], text: &str, colour: Colour) {
        self.enlarged(at, text, colour, 1.0);
    }

    /// Draws text that is scaled with the picture: by its number of rows divided by 480, rounded, but at least by 1.
    pub fn label(&mut self, at: [f64; 2], text: &str, colour: Colour) {
        let times = (self.size().height as f64 / 480.0).round().max(1.0);
        self.enlarged(at, text, colour, times);
    }

    fn enlarged(&mut self, [left, top]: [f64; 2], text: &str, colour: Colour, times: f64) {
        let at = [left.round(), top.round()];
        for dy in [-times, 0.0, times] {
            for dx in [-times, 0.0, times] {
                self.glyphs([at[0] + dx, at[1] + dy], text, SHADOW, times);
            }
        }
        self.glyphs(at, text, colour, times);
    }

    fn glyphs(&mut self, [mut left, top]: [f64; 2], text: &str, colour: Colour, times: f64) {
        let advance = times * get_raster_width(WEIGHT, SIZE) as f64;
        for character in text.chars() {
            let glyph =
                get_raster(character, WEIGHT, SIZE).or_else(|| get_raster('?', WEIGHT, SIZE));
            let corners = [
                left,
                top,
                left + advance - 1.0,
                top + times * TEXT_HEIGHT as f64 - 1.0,
            ];
            self.paint(corners, colour, |x, y| {
                // An index below 0 wraps to a large one, where the glyph has no pixel.
                let of_glyph = |at: f64| (at / times).floor() as i64 as usize;
                let (column, row) = (of_glyph(x - left), of_glyph(y - top));
                let pixel = glyph.and_then(|glyph| glyph.pixel(column, row));
                f64::from(pixel.unwrap_or(0)) / 255.0
            });
            left += advance;
        }
    }
}
