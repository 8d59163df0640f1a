//! Width and height of an image.

/// Width and height of an image, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Size {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Size {
    /// Creates a size. The width comes first, as everywhere else in this crate.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// Returns the number of bytes of an RGB image of this size, `width * height * 3`.
    pub const fn rgb_bytes(self) -> usize {
        self.width * self.height * 3
    }

    /// Returns the largest factor up to `most` that divides both sides; at least 1.
    pub fn divisor(self, most: usize) -> usize {
        let divides =
            |by: &usize| self.width.is_multiple_of(*by) && self.height.is_multiple_of(*by);
        (1..=most).rev().find(divides).unwrap_or(1)
    }

    /// Returns the size of the image after shrinking it by a factor of at least 1.
    #[must_use]
    pub const fn shrunk(self, by: usize) -> Self {
        Self::new(self.width / by, self.height / by)
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}x{}", self.width, self.height)
    }
}
