//! A view of an 8-bit colour image.

/// A view of interleaved 8-bit RGB, row major, without padding between rows.
///
/// The pixels may be in shared memory; the view does not copy them.
#[derive(Debug, Clone, Copy)]
pub struct Rgb8View<'a> {
    width: usize,
    height: usize,
    data: &'a [u8],
}

/// The number of bytes does not match the size of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("an RGB image of {width}x{height} pixels must have {expected} bytes, but there are {got}")]
pub struct ImageSizeError {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Number of bytes expected for the size.
    pub expected: usize,
    /// Number of bytes given.
    pub got: usize,
}

impl<'a> Rgb8View<'a> {
    /// Views `data` as an image of `width` x `height` pixels, 3 bytes each.
    ///
    /// # Errors
    ///
    /// Fails with [`ImageSizeError`] if `data` is not exactly `3 * width * height` bytes.
    pub fn new(width: usize, height: usize, data: &'a [u8]) -> Result<Self, ImageSizeError> {
        let expected = width.saturating_mul(height).saturating_mul(3);
        if data.len() == expected {
            Ok(Self {
                width,
                height,
                data,
            })
        } else {
            Err(ImageSizeError {
                width,
                height,
                expected,
                got: data.len(),
            })
        }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The bytes: `height x width x 3`.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_pixels_that_do_not_fill_the_image() {
        let got = Rgb8View::new(2, 3, &[0; 17]).unwrap_err();
        let want = ImageSizeError {
            width: 2,
            height: 3,
            expected: 18,
            got: 17,
        };
        assert_eq!(got, want);
        let huge = Rgb8View::new(usize::MAX, usize::MAX, &[]).unwrap_err();
        assert_eq!(huge.expected, usize::MAX);
    }
}
