//! Rotates or mirrors stored pixels so that a picture is upright.

use std::fmt;

use image::metadata::Orientation;
use image::{DynamicImage, RgbImage};

use crate::Size;

/// The rotation or mirroring that shows stored pixels upright, as given by the tag of an image (EXIF) or of a video (display matrix).
///
/// ```
/// use footage::{Size, Turn};
///
/// let as_stored = Turn::default();
/// assert!(as_stored.is_none());
/// assert_eq!(as_stored.apply(Size::new(1, 1), vec![1, 2, 3]), (Size::new(1, 1), vec![1, 2, 3]));
/// assert_eq!(Turn::clockwise(90).unwrap().size(Size::new(640, 480)), Size::new(480, 640));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn(pub(crate) Orientation);

/// How the pictures of footage are rotated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rotation {
    /// Pictures are not rotated: the pixels stay as they are stored. A calibration that was made with stored pixels refers to these pixels.
    #[default]
    Stored,
    /// Pictures are rotated according to the tag, as video players show them.
    Tag,
    /// Pictures are rotated by this rotation, regardless of the tag.
    By(Turn),
}

impl Rotation {
    /// Returns the rotation that is applied to a picture with a given tag.
    pub fn turn(self, tag: Turn) -> Turn {
        match self {
            Self::Stored => Turn::default(),
            Self::Tag => tag,
            Self::By(turn) => turn,
        }
    }
}

impl Default for Turn {
    fn default() -> Self {
        Self(Orientation::NoTransforms)
    }
}

/// All rotations: their names in words, and the `ffmpeg` filters that do the same.
const KNOWN: [(Orientation, &str, &str); 8] = [
    (Orientation::NoTransforms, "as stored", ""),
    (
        Orientation::Rotate90,
        "rotated by 90 degrees to the right",
        "transpose=clock",
    ),
    (
        Orientation::Rotate180,
        "rotated by 180 degrees",
        "hflip,vflip",
    ),
    (
        Orientation::Rotate270,
        "rotated by 90 degrees to the left",
        "transpose=cclock",
    ),
    (Orientation::FlipHorizontal, "mirrored", "hflip"),
    (
        Orientation::FlipVertical,
        "rotated by 180 degrees and mirrored",
        "vflip",
    ),
    (
        Orientation::Rotate90FlipH,
        "rotated by 90 degrees to the right and mirrored",
        "transpose=cclock_flip",
    ),
    (
        Orientation::Rotate270FlipH,
        "rotated by 90 degrees to the left and mirrored",
        "transpose=clock_flip",
    ),
];

impl Turn {
    /// Returns the clockwise rotation by 0, 90, 180 or 270 degrees; `None` for any other angle.
    pub fn clockwise(degrees: u32) -> Option<Self> {
        let turn = match degrees {
            0 => Orientation::NoTransforms,
            90 => Orientation::Rotate90,
            180 => Orientation::Rotate180,
            270 => Orientation::Rotate270,
            _ => return None,
        };
        Some(Self(turn))
    }

    /// Returns the rotation given by a display matrix (ISO/IEC 14496-12, 8.2.2), to the nearest 90 degrees.
    ///
    /// * `[a, b, c, d]`: a stored point `(x, y)` is shown at `(a x + c y, b x + d y)`.
    pub(crate) fn of_matrix([a, b, c, d]: [f64; 4]) -> Self {
        let is_upright = a.abs() + d.abs() >= b.abs() + c.abs();
        let [first, second] = if is_upright { [a, d] } else { [b, c] };
        Self(match (is_upright, first < 0.0, second < 0.0) {
            (true, false, false) => Orientation::NoTransforms,
            (true, true, true) => Orientation::Rotate180,
            (true, true, false) => Orientation::FlipHorizontal,
            (true, false, true) => Orientation::FlipVertical,
            (false, false, true) => Orientation::Rotate90,
            (false, true, false) => Orientation::Rotate270,
            (false, false, false) => Orientation::Rotate90FlipH,
            (false, true, true) => Orientation::Rotate270FlipH,
        })
    }

    /// Returns true if the pixels are already stored upright.
    pub fn is_none(self) -> bool {
        self.0 == Orientation::NoTransforms
    }

    /// Returns true if rows become columns.
    pub fn swaps_sides(self) -> bool {
        matches!(
            self.0,
            Orientation::Rotate90
                | Orientation::Rotate270
                | Orientation::Rotate90FlipH
                | Orientation::Rotate270FlipH
        )
    }

    /// Returns the size of the upright picture.
    pub fn size(self, stored: Size) -> Size {
        if self.swaps_sides() {
            Size::new(stored.height, stored.width)
        } else {
            stored
        }
    }

    /// Rotates stored pixels so that the picture is upright; if the number of bytes does not match the size, the picture is returned
    /// unchanged.
    pub fn apply(self, size: Size, rgb: Vec<u8>) -> (Size, Vec<u8>) {
        if self.is_none() || rgb.len() != size.rgb_bytes() {
            return (size, rgb);
        }
        let stored = RgbImage::from_raw(size.width as u32, size.height as u32, rgb);
        let mut image = DynamicImage::from(stored.unwrap_or_default());
        image.apply_orientation(self.0);
        (self.size(size), image.into_rgb8().into_raw())
    }

    /// Returns the `ffmpeg` filters that rotate an RGB picture; `None` if nothing has to be done.
    pub(crate) fn filters(self) -> Option<String> {
        let known = KNOWN.iter().find(|known| known.0 == self.0)?;
        // The filters work in RGB, so that every pixel of the result is a stored pixel at another position.
        (!known.2.is_empty()).then(|| format!("format=rgb24,{}", known.2))
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = KNOWN.iter().find(|known| known.0 == self.0);
        f.write_str(known.map_or("", |known| known.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the point at which a stored point is shown, computed from the pixels.
    fn shown([x, y]: [usize; 2], turn: Turn) -> [usize; 2] {
        let size = Size::new(3, 2);
        let mut rgb = vec![0; size.rgb_bytes()];
        rgb[3 * (y * 3 + x)] = 255;
        let (turned, rgb) = turn.apply(size, rgb);
        let at = rgb.iter().position(|byte| *byte == 255).unwrap() / 3;
        [at % turned.width, at / turned.width]
    }

    #[test]
    fn a_display_matrix_rotates_every_pixel_correctly() {
        for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            for sign in [1.0, -1.0] {
                let [c, d] = [-b * sign, a * sign];
                let turn = Turn::of_matrix([a, b, c, d]);
                for (x, y) in [(0, 0), (2, 0), (1, 1)] {
                    // Points are counted from the middle, so that no shift is needed.
                    let [u, v] = [x as f64 - 1.0, y as f64 - 0.5];
                    let due = [a * u + c * v, b * u + d * v];
                    let middle = if turn.swaps_sides() {
                        [0.5, 1.0]
                    } else {
                        [1.0, 0.5]
                    };
                    let got = shown([x, y], turn);
                    let got = [0, 1].map(|axis| got[axis] as f64 - middle[axis]);
                    assert_eq!(got, due, "{turn} of {:?}", [a, b, c, d]);
                }
            }
        }
    }

    #[test]
    fn a_rotation_is_rounded_to_the_nearest_quarter_turn() {
        assert_eq!(
            Turn::of_matrix([0.1, 0.99, -0.99, 0.1]),
            Turn::clockwise(90).unwrap()
        );
        assert!(Turn::of_matrix([0.99, 0.1, -0.1, 0.99]).is_none());
        assert_eq!(Turn::clockwise(45), None);
    }
}
