//! A picture, and the shapes that can be drawn on it.

use core::ops::Range;
use std::io;
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _, ImageError};

use super::Colour;
use crate::Size;

/// Reason why a picture cannot be saved.
#[derive(Debug, thiserror::Error)]
pub enum OverlayError {
    /// The file cannot be written.
    #[error("cannot write {}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the error.
        source: io::Error,
    },
    /// The picture cannot be encoded, because it is empty (has no pixels).
    #[error("cannot encode {}", path.display())]
    Encode {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the error.
        source: ImageError,
    },
}

/// A picture to draw on. Points are `[x, y]` in pixels, with the centre of the top-left pixel at `(0, 0)`.
///
/// Edges are anti-aliased: the colour of a pixel is blended in proportion to the area that the shape covers. Shapes are clipped to the
/// picture. A shape with a coordinate that is not finite is not drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    size: Size,
    rgb: Vec<u8>,
}

impl Canvas {
    /// Creates a picture of one colour.
    pub fn new(size: Size, colour: Colour) -> Self {
        Self {
            size,
            rgb: colour.repeat(size.width * size.height),
        }
    }

    /// Copies a part of a picture; returns `None` if the part is empty or outside the picture.
    ///
    /// * `size` and `rgb`: the picture.
    /// * `columns` and `rows`: the part.
    pub fn part(size: Size, rgb: &[u8], [columns, rows]: [Range<usize>; 2]) -> Option<Self> {
        let part = Size::new(columns.len(), rows.len());
        let row = |y: usize| {
            let at = 3 * y * size.width;
            rgb.get(at + 3 * columns.start..at + 3 * columns.end)
        };
        let is_inside = columns.end <= size.width && part.rgb_bytes() > 0;
        let pixels: Vec<&[u8]> = rows.filter(|_| is_inside).map(row).collect::<Option<_>>()?;
        is_inside.then(|| Self::from_rgb(part, &pixels.concat()))
    }

    /// Returns the picture as a JPEG file; `None` if it is too large for the format.
    ///
    /// * `quality`: JPEG quality, in percent.
    pub fn jpeg(&self, quality: u8) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
        let [width, height] = [self.size.width, self.size.height].map(u32::try_from);
        let written = encoder.write_image(
            self.rgb(),
            width.ok()?,
            height.ok()?,
            ExtendedColorType::Rgb8,
        );
        written.ok().map(|()| bytes)
    }

    /// Copies an image.
    ///
    /// # Panics
    ///
    /// Panics if `rgb` is not `width * height * 3` bytes.
    pub fn from_rgb(size: Size, rgb: &[u8]) -> Self {
        assert_eq!(rgb.len(), size.rgb_bytes(), "the image is {size}");
        Self {
            size,
            rgb: rgb.to_vec(),
        }
    }

    /// Returns the size of the picture.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Returns the pixels of the picture, RGB, row major.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// Draws a line between two points with round ends, `width` pixels wide.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Colour) {
        let ([x1, y1], [x2, y2]) = (from, to);
        let reach = width / 2.0 + 1.0;
        let corners = [x1.min(x2), y1.min(y2), x1.max(x2), y1.max(y2)];
        let [dx, dy] = [x2 - x1, y2 - y1];
        let length_squared = dx * dx + dy * dy;
        self.paint(grown(corners, reach), colour, |x, y| {
            let along = if length_squared > 0.0 {
                (((x - x1) * dx + (y - y1) * dy) / length_squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let distance = length(x - x1 - along * dx, y - y1 - along * dy);
            width / 2.0 + 0.5 - distance
        });
    }

    /// Draws lines from point to point; used for curves.
    pub fn polyline(&mut self, points: &[[f64; 2]], width: f64, colour: Colour) {
        for ends in points.windows(2) {
            self.line(ends[0], ends[1], width, colour);
        }
    }

    /// Draws a filled circle.
    pub fn disc(&mut self, [cx, cy]: [f64; 2], radius: f64, colour: Colour) {
        let corners = grown([cx, cy, cx, cy], radius + 1.0);
        self.paint(corners, colour, |x, y| {
            radius + 0.5 - length(x - cx, y - cy)
        });
    }

    /// Draws the outline of a circle: a line that is `width` pixels wide along the radius.
    pub fn ring(&mut self, [cx, cy]: [f64; 2], radius: f64, width: f64, colour: Colour) {
        let corners = grown([cx, cy, cx, cy], radius + width / 2.0 + 1.0);
        self.paint(corners, colour, |x, y| {
            width / 2.0 + 0.5 - (length(x - cx, y - cy) - radius).abs()
        });
    }

    /// Draws the outline of a box `[x1, y1, x2, y2]`.
    pub fn frame(&mut self, [x1, y1, x2, y2]: [f64; 4], width: f64, colour: Colour) {
        let corners = [[x1, y1], [x2, y1], [x2, y2], [x1, y2], [x1, y1]];
        self.polyline(&corners, width, colour);
    }

    /// Copies a picture, which must fit, with its top-left pixel at column `x`, row `y`.
    pub(super) fn put(&mut self, picture: &Self, [x, y]: [usize; 2]) {
        let rows = picture.rgb.chunks_exact(picture.size.width * 3);
        for (row, from) in rows.enumerate() {
            let at = ((y + row) * self.size.width + x) * 3;
            self.rgb[at..at + from.len()].copy_from_slice(from);
        }
    }

    /// Blends a colour into the pixels of a box `[x1, y1, x2, y2]`; `cover` returns the fraction of each pixel that is covered.
    pub(super) fn paint(
        &mut self,
        corners: [f64; 4],
        colour: Colour,
        cover: impl Fn(f64, f64) -> f64,
    ) {
        if !corners.iter().all(|corner| corner.is_finite()) {
            return;
        }
        let [x1, y1, x2, y2] = corners;
        let range = |low: f64, high: f64, n: usize| {
            low.max(0.0) as usize..(high.ceil() + 1.0).clamp(0.0, n as f64) as usize
        };
        for y in range(y1, y2, self.size.height) {
            for x in range(x1, x2, self.size.width) {
                let cover = cover(x as f64, y as f64);
                // The condition is false for NaN, which occurs where distances overflow.
                if cover > 0.0 {
                    let at = (y * self.size.width + x) * 3;
                    blend(&mut self.rgb[at..at + 3], colour, cover.min(1.0));
                }
            }
        }
    }

    /// Returns the bytes of a PNG.
    ///
    /// # Errors
    ///
    /// Fails if a PNG cannot have this size.
    pub fn png(&self) -> Result<Vec<u8>, ImageError> {
        let mut png = Vec::new();
        PngEncoder::new(&mut png).write_image(
            &self.rgb,
            self.size.width as u32,
            self.size.height as u32,
            ExtendedColorType::Rgb8,
        )?;
        Ok(png)
    }

    /// Writes a PNG. A reader of `path` sees the old file or the new one, never a part of it.
    ///
    /// # Errors
    ///
    /// Returns an [`OverlayError`] on failure. No partial file remains.
    pub fn save_png(&self, path: &Path) -> Result<(), OverlayError> {
        let png = self.png().map_err(|source| OverlayError::Encode {
            path: path.to_path_buf(),
            source,
        })?;
        files::replace_unsynced(path, &png).map_err(|source| OverlayError::Io {
            path: path.to_path_buf(),
            source,
        })
    }
}

fn grown([x1, y1, x2, y2]: [f64; 4], by: f64) -> [f64; 4] {
    [x1 - by, y1 - by, x2 + by, y2 + by]
}

fn blend(pixel: &mut [u8], colour: Colour, cover: f64) {
    for (old, new) in pixel.iter_mut().zip(colour) {
        let mixed = f64::from(*old) + cover * (f64::from(new) - f64::from(*old));
        *old = mixed.round() as u8;
    }
}

/// Returns the length of a vector.
#[expect(
    clippy::imprecise_flops,
    reason = "`hypot` takes several times as long, and its last bits do not matter here"
)]
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
