//! An owned image.

use std::path::Path;

use footage::{FootageError, Size};
use kernels::Rgb8View;

/// An image of interleaved 8-bit RGB, row major, without padding between rows.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    size: Size,
    rgb: Vec<u8>,
}

impl Picture {
    /// Makes an image of one colour.
    pub fn filled(size: Size, colour: [u8; 3]) -> Self {
        Self {
            size,
            rgb: colour.repeat(size.width * size.height),
        }
    }

    /// Makes an image of given pixels.
    ///
    /// * `rgb`: `width * height * 3` bytes.
    ///
    /// # Errors
    ///
    /// Fails with [`ImageSizeError`](kernels::ImageSizeError) if there are more or fewer bytes.
    pub fn new(size: Size, rgb: Vec<u8>) -> Result<Self, kernels::ImageSizeError> {
        Rgb8View::new(size.width, size.height, &rgb)?;
        Ok(Self { size, rgb })
    }

    /// Decodes an image file. The pixels are the same as those that [`footage::Source`] gives for detection.
    ///
    /// # Errors
    ///
    /// Fails with [`FootageError`], which names the file.
    pub fn read(path: &Path) -> Result<Self, FootageError> {
        let (size, rgb) = footage::read_image(path)?;
        Ok(Self { size, rgb })
    }

    /// Width and height, in pixels.
    pub fn size(&self) -> Size {
        self.size
    }

    /// The bytes: `height x width x 3`.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The bytes, as a mutable slice.
    pub fn rgb_mut(&mut self) -> &mut [u8] {
        &mut self.rgb
    }

    /// A view of the pixels, in the type that detection takes.
    ///
    /// # Panics
    ///
    /// Never panics: the number of bytes is checked when a picture is made.
    #[expect(
        clippy::expect_used,
        reason = "the number of bytes is checked when a picture is made"
    )]
    pub fn view(&self) -> Rgb8View<'_> {
        let view = Rgb8View::new(self.size.width, self.size.height, &self.rgb);
        view.expect("the number of bytes is checked when a picture is made")
    }

    /// The part of the image within a rectangle `[x1, y1, x2, y2]` in pixels, and the position of its top-left pixel.
    pub fn crop(&self, within: [f64; 4]) -> (Self, [f64; 2]) {
        let range = |low: f64, high: f64, n: usize| {
            let start = low.floor().clamp(0.0, n as f64) as usize;
            let end = (high.ceil() + 1.0).clamp(0.0, n as f64) as usize;
            start..end.max(start)
        };
        let x = range(within[0], within[2], self.size.width);
        let y = range(within[1], within[3], self.size.height);
        let row = |row: usize| {
            let first = row * self.size.width;
            &self.rgb[3 * (first + x.start)..3 * (first + x.end)]
        };
        let origin = [x.start as f64, y.start as f64];
        let cropped = Self {
            size: Size::new(x.len(), y.len()),
            rgb: y.flat_map(row).copied().collect(),
        };
        (cropped, origin)
    }
}

impl std::fmt::Debug for Picture {
    /// Prints only the size, because there are too many pixels to print.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Picture({})", self.size)
    }
}
