//! Drawing on pictures.

mod canvas;
mod compose;
mod text;

pub use canvas::{Canvas, OverlayError};
pub use compose::{Tile, compose};
pub use text::{TEXT_HEIGHT, text_width};

use crate::Size;

/// A colour: red, green, blue.
pub type Colour = [u8; 3];

/// Colour of limbs on the left: sky blue. People with any kind of colour vision can distinguish [`LEFT`], [`RIGHT`] and [`ACCENT`]
/// (M. Okabe and K. Ito, *Color Universal Design*, 2008).
pub const LEFT: Colour = [86, 180, 233];
/// Colour of limbs on the right: orange.
pub const RIGHT: Colour = [230, 159, 0];
/// Colour of limbs in the middle: white.
pub const CENTRE: Colour = [245, 245, 245];
/// Colour of other marks, such as epipolar lines and boxes: reddish purple.
pub const ACCENT: Colour = [204, 121, 167];
/// Colour of a pose for comparison: grey.
pub const FAINT: Colour = [150, 150, 150];

/// Colour drawn under lines and text, so that they are visible on any background.
const SHADOW: Colour = [20, 20, 20];

/// Side of the body, which decides the colour of a limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Left side, drawn in [`LEFT`].
    Left,
    /// Right side, drawn in [`RIGHT`].
    Right,
    /// Middle of the body, drawn in [`CENTRE`].
    Centre,
}

impl Side {
    /// Returns the colour of the limbs on this side.
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
    /// Side of the body, which decides the colour.
    pub side: Side,
}

/// Returns the line width that is visible on a picture of this size: 1/240 of its height, at least 1.5 pixels.
///
/// This width suits a person who fills the picture. The sizes of other marks are proportional to it.
pub fn line_width(size: Size) -> f64 {
    (size.height as f64 / 240.0).max(1.5)
}

/// Draws a skeleton: limbs with a dark edge, and a dot on each end of a limb.
///
/// Lines have the width of [`line_width`].
///
/// * `points`: pixels. Limbs with an end that is missing or not finite are not drawn.
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
