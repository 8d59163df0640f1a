//! Width and height of an image.

/// Width and height of an image, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// Width first, as everywhere in this crate.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// Bytes of an RGB image of this size, `width * height * 3`.
    pub const fn rgb_bytes(self) -> usize {
        self.width * self.height * 3
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}x{}", self.width, self.height)
    }
}
