//! Drawing on pictures for people to look at.

use std::path::Path;

/// Red, green, blue.
pub type Colour = [u8; 3];

/// Limbs on the left, blue: apart from [`RIGHT`] for every kind of colour vision (Okabe and Ito).
pub const LEFT: Colour = [0, 114, 178];
/// Limbs on the right, orange.
pub const RIGHT: Colour = [230, 159, 0];
/// Limbs in the middle, green.
pub const CENTRE: Colour = [0, 158, 115];

/// Side of the body, which decides the colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// [`LEFT`].
    Left,
    /// [`RIGHT`].
    Right,
    /// [`CENTRE`].
    Centre,
}

/// A line between two points of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limb {
    /// Index of one end.
    pub from: usize,
    /// Index of the other end.
    pub to: usize,
    /// Which colour.
    pub side: Side,
}

/// Why a picture cannot be saved.
#[derive(Debug, thiserror::Error)]
pub enum OverlayError {
    /// The file cannot be written.
    #[error("cannot write {}", path.display())]
    Io {
        /// Which.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The picture cannot be encoded.
    #[error("cannot encode {}", path.display())]
    Encode {
        /// Which.
        path: std::path::PathBuf,
        /// Why.
        source: image::ImageError,
    },
}

/// A picture to draw on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    size: crate::Size,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A picture of one colour.
    pub fn new(size: crate::Size, colour: Colour) -> Self {
        Self {
            size,
            rgb: colour.repeat(size.width * size.height),
        }
    }

    /// A copy of an image.
    ///
    /// # Panics
    ///
    /// If `rgb` is not `width * height * 3` bytes.
    pub fn from_rgb(size: crate::Size, rgb: &[u8]) -> Self {
        assert_eq!(rgb.len(), size.rgb_bytes(), "image of {size}");
        Self {
            size,
            rgb: rgb.to_vec(),
        }
    }

    /// Its size.
    pub fn size(&self) -> crate::Size {
        self.size
    }

    /// Its pixels.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// A line between two points, `width` pixels wide.
    pub fn line(&mut self, _from: [f64; 2], _to: [f64; 2], _width: f64, _colour: Colour) {}
    /// Lines from point to point.
    pub fn polyline(&mut self, _points: &[[f64; 2]], _width: f64, _colour: Colour) {}
    /// A filled circle.
    pub fn disc(&mut self, _centre: [f64; 2], _radius: f64, _colour: Colour) {}
    /// The outline of a circle.
    pub fn ring(&mut self, _centre: [f64; 2], _radius: f64, _width: f64, _colour: Colour) {}
    /// The outline of a box `[x1, y1, x2, y2]`.
    pub fn frame(&mut self, _corners: [f64; 4], _width: f64, _colour: Colour) {}
    /// A filled box `[x1, y1, x2, y2]`, `opacity` from 0 to 1.
    pub fn filled_box(&mut self, _corners: [f64; 4], _opacity: f64, _colour: Colour) {}
    /// Text, its top-left corner at `at`.
    pub fn text(&mut self, _at: [f64; 2], _text: &str, _colour: Colour) {}
    /// Writes a PNG, whole or not at all.
    pub fn save_png(&self, _path: &Path) -> Result<(), OverlayError> {
        todo!()
    }
}

/// Draws a skeleton.
pub fn draw_limbs(_canvas: &mut Canvas, _points: &[[f64; 2]], _limbs: &[Limb]) {}

/// A picture with a caption above it.
#[derive(Debug, Clone, Copy)]
pub struct Tile<'a> {
    /// The picture.
    pub picture: &'a Canvas,
    /// One line of text.
    pub caption: &'a str,
}

/// Puts pictures side by side, `n_columns` in a row.
pub fn compose(_tiles: &[Tile<'_>], _n_columns: usize) -> Canvas {
    todo!()
}
