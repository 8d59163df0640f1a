//! A grey picture, with interpolation, mirroring and scaling.

use nalgebra::{Point2, Vector2};

/// A grey picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    /// Creates a picture from grey values, row by row. Returns `None` if the picture would be empty, or if there are not width times height
    /// values.
    pub fn new(width: usize, height: usize, pixels: Vec<u8>) -> Option<Self> {
        let count = width.checked_mul(height)?;
        (count > 0 && count == pixels.len()).then_some(Self {
            width,
            height,
            pixels,
        })
    }

    /// Creates a picture from red, green and blue values with the weights of ITU-R BT.601. Returns `None` in the same cases as
    /// [`new`](Self::new).
    pub fn of_rgb(width: usize, height: usize, rgb: &[u8]) -> Option<Self> {
        let grey = |rgb: &[u8]| {
            let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(u32::from);
            ((299 * r + 587 * g + 114 * b + 500) / 1000) as u8
        };
        Self::new(width, height, rgb.chunks_exact(3).map(grey).collect())
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the grey values, row by row.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Returns the grey value of a pixel; outside the picture, the grey value of the nearest pixel.
    pub(crate) fn at(&self, x: isize, y: isize) -> f64 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        f64::from(self.pixels[y * self.width + x])
    }

    /// Returns the grey value between pixels, interpolated bilinearly.
    pub(crate) fn between(&self, at: Point2<f64>) -> f64 {
        let (left, top) = (at.x.floor(), at.y.floor());
        let (x, y) = (left as isize, top as isize);
        let (u, v) = (at.x - left, at.y - top);
        (1.0 - v) * ((1.0 - u) * self.at(x, y) + u * self.at(x + 1, y))
            + v * ((1.0 - u) * self.at(x, y + 1) + u * self.at(x + 1, y + 1))
    }

    /// Returns the gradient of the grey value between pixels, from differences over two pixels.
    pub(crate) fn slope(&self, at: Point2<f64>) -> Vector2<f64> {
        let side = |dx: f64, dy: f64| self.between(Point2::new(at.x + dx, at.y + dy));
        Vector2::new(
            0.5 * (side(1.0, 0.0) - side(-1.0, 0.0)),
            0.5 * (side(0.0, 1.0) - side(0.0, -1.0)),
        )
    }

    /// Returns true if a point is inside the picture by a margin in pixels.
    pub(crate) fn holds(&self, at: Point2<f64>, margin: f64) -> bool {
        at.x >= margin
            && at.y >= margin
            && at.x <= self.width as f64 - 1.0 - margin
            && at.y <= self.height as f64 - 1.0 - margin
    }

    /// Returns the picture with black and white swapped.
    #[must_use]
    pub(crate) fn inverted(&self) -> Self {
        Self {
            pixels: self.pixels.iter().map(|pixel| 255 - pixel).collect(),
            ..*self
        }
    }

    /// Returns the picture with left and right swapped.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let rows = self.pixels.chunks_exact(self.width);
        Self {
            pixels: rows.flat_map(|row| row.iter().rev().copied()).collect(),
            ..*self
        }
    }

    /// Returns the picture at twice its size: pixel x moves to 2 x + 0.5.
    #[must_use]
    pub(crate) fn doubled(&self) -> Self {
        let (width, height) = (2 * self.width, 2 * self.height);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let at = Point2::new((x as f64 - 0.5) / 2.0, (y as f64 - 0.5) / 2.0);
                pixels.push((self.between(at) + 0.5) as u8);
            }
        }
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Returns the picture at half its size, as the mean of four pixels: pixel x moves to (x - 0.5) / 2. Returns `None` below 2 pixels.
    pub(crate) fn halved(&self) -> Option<Self> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = [2 * y, 2 * y + 1].map(|row| &self.pixels[row * self.width..]);
            for x in 0..width {
                let sum: u32 =
                    rows.iter().map(|row| u32::from(row[2 * x]) + u32::from(row[2 * x + 1])).sum();
                pixels.push(((sum + 2) / 4) as u8);
            }
        }
        Self::new(width, height, pixels)
    }
}
