//! Drawing on pictures.

mod canvas;
mod compose;
mod text;

pub use canvas::{Canvas, OverlayError};
pub use compose::{Tile, compose};
pub use text::{TEXT_HEIGHT, text_width};

use crate::Size;

/// Red, green, blue.
pub type Colour = [u8; 3];

/// Limbs on the left: sky blue. [`LEFT`], [`RIGHT`] and [`ACCENT`] are told apart by every kind of colour
/// vision (M. Okabe and K. Ito, *Color Universal Design*, 2008).
pub const LEFT: Colour = [86, 180, 233];
/// Limbs on the right: orange.
pub const RIGHT: Colour = [230, 159, 0];
/// Limbs in the middle: white.
pub const CENTRE: Colour = [245, 245, 245];
/// Other marks: epipolar lines, boxes. Reddish purple.
pub const ACCENT: Colour = [204, 121, 167];
/// A pose to compare with. Grey.
pub const FAINT: Colour = [150, 150, 150];

/// Drawn under lines and text, so that they show on any background.
const SHADOW: Colour = [20, 20, 20];

/// Side of the body, which decides the colour of a limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// [`LEFT`].
    Left,
    /// [`RIGHT`].
    Right,
    /// [`CENTRE`].
    Centre,
}

impl Side {
    /// The colour of its limbs.
    pub const fn colour(self) -> Colour {
        match self {
            Self::Left => LEFT,
            Self::Right => RIGHT,
            Self::Centre => CENTRE,
        }
    }
}

/// A line between two points of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limb {
    /// Index of one end.
    pub from: usize,
    /// Index of the other end.
    pub to: usize,
    /// Which side it is drawn as.
    pub side: Side,
}

/// How wide a line must be to show on a picture of this size: 1/240 of its height, at least 1.5 pixels.
///
/// That suits a person who fills the picture. Other marks are drawn in proportion to it.
pub fn line_width(size: Size) -> f64 {
    (size.height as f64 / 240.0).max(1.5)
}

/// Draws a skeleton: limbs with a dark edge, and a dot on every end of one.
///
/// Lines have the width of [`line_width`].
///
/// * `points`: pixels; limbs with an end that is missing or not finite are left out.
pub fn draw_limbs(canvas: &mut Canvas, points: &[[f64; 2]], limbs: &[Limb]) {
    let width = line_width(canvas.size());
    let point = |index: usize| {
        let point = points.get(index).copied();
        point.filter(|point| point.iter().all(|value| value.is_finite()))
    };
    let visible = || {
        limbs.iter().filter_map(|limb| {
            let (from, to) = (point(limb.from)?, point(limb.to)?);
            Some((from, to, limb.side.colour()))
        })
    };
    for (from, to, _) in visible() {
        canvas.line(from, to, width + 2.0, SHADOW);
    }
    for (from, to, colour) in visible() {
        canvas.line(from, to, width, colour);
    }
    for (from, to, colour) in visible() {
        for end in [from, to] {
            canvas.disc(end, 0.8 * width + 1.0, SHADOW);
            canvas.disc(end, 0.8 * width, colour);
        }
    }
}
