//! Decodes one image file to 8-bit RGB.

use std::fmt;
use std::io::Cursor;
use std::path::Path;

use image::error::{DecodingError, ImageFormatHint, LimitError, LimitErrorKind};
use image::metadata::Orientation;
use image::{
    ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, RgbImage,
};

use crate::{FootageError, Size};

/// The orientation tag (EXIF) of a picture: how its stored pixels must be turned to show it upright.
///
/// ```
/// use footage::{Size, Turn};
///
/// let as_stored = Turn::default();
/// assert!(as_stored.is_none());
/// assert_eq!(as_stored.apply(Size::new(1, 1), vec![1, 2, 3]), (Size::new(1, 1), vec![1, 2, 3]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn(Orientation);

impl Default for Turn {
    fn default() -> Self {
        Self(Orientation::NoTransforms)
    }
}

impl Turn {
    /// Whether the pixels are stored upright.
    pub fn is_none(self) -> bool {
        self.0 == Orientation::NoTransforms
    }

    /// The upright picture of stored pixels; unchanged if the number of bytes does not fit the size.
    pub fn apply(self, size: Size, rgb: Vec<u8>) -> (Size, Vec<u8>) {
        if self.is_none() || rgb.len() != size.rgb_bytes() {
            return (size, rgb);
        }
        let stored = RgbImage::from_raw(size.width as u32, size.height as u32, rgb);
        let mut image = DynamicImage::from(stored.unwrap_or_default());
        image.apply_orientation(self.0);
        let size = Size::new(image.width() as usize, image.height() as usize);
        (size, image.into_rgb8().into_raw())
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Orientation::NoTransforms => "as stored",
            Orientation::Rotate90 => "turned by 90 degrees to the right",
            Orientation::Rotate180 => "turned by 180 degrees",
            Orientation::Rotate270 => "turned by 90 degrees to the left",
            Orientation::FlipHorizontal => "mirrored",
            Orientation::FlipVertical => "turned by 180 degrees and mirrored",
            Orientation::Rotate90FlipH => "turned by 90 degrees to the right and mirrored",
            Orientation::Rotate270FlipH => "turned by 90 degrees to the left and mirrored",
        })
    }
}

/// The largest image decoded, bytes: a header of 30 bytes may claim any size.
const MAX_BYTES: u64 = 1 << 29;

/// An image file in memory. Its format is detected from its content, never from its name.
pub(super) struct Encoded<'a> {
    path: &'a Path,
    bytes: Vec<u8>,
}

impl<'a> Encoded<'a> {
    pub(super) fn read(path: &'a Path) -> Result<Self, FootageError> {
        let bytes = std::fs::read(path).map_err(|source| FootageError::Io {
            path: path.to_path_buf(),
            source,
        })?;
        if bytes.is_empty() {
            return Err(FootageError::Empty {
                path: path.to_path_buf(),
            });
        }
        Ok(Self { path, bytes })
    }

    /// Width and height, from the header.
    pub(super) fn size(&self) -> Result<Size, FootageError> {
        let decoder = self.decoder()?;
        Ok(size_of(&decoder))
    }

    /// The orientation tag (EXIF); a tag that cannot be read counts as none.
    pub(super) fn turn(&self) -> Turn {
        let decoder = self.decoder();
        let tag = decoder.and_then(|mut decoder| {
            let tag = decoder.orientation();
            tag.map_err(|source| self.error(source))
        });
        Turn(tag.unwrap_or(Orientation::NoTransforms))
    }

    /// The pixels, row major: grey is replicated, alpha dropped, 16 bits rounded to 8, orientation tags
    /// ignored.
    ///
    /// `rgb` must have the size of the image.
    pub(super) fn decode_into(&self, rgb: &mut [u8]) -> Result<(), FootageError> {
        let decoder = self.decoder()?;
        let wrong = |source| self.error(source);
        if self.is_jpeg() && jpeg_into(&self.bytes, rgb) {
            return Ok(());
        }
        if decoder.color_type() == ColorType::Rgb8 {
            return decoder.read_image(rgb).map_err(wrong);
        }
        let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
        rgb.copy_from_slice(image.into_rgb8().as_raw());
        Ok(())
    }

    fn decoder(&self) -> Result<impl ImageDecoder + '_, FootageError> {
        let wrong = |source| self.error(source);
        let reader = ImageReader::new(Cursor::new(&self.bytes[..]))
            .with_guessed_format()
            .map_err(|source| self.error(ImageError::IoError(source)))?;
        if reader.format() == Some(ImageFormat::Jpeg) && !jpeg_is_whole(&self.bytes) {
            let hint = ImageFormatHint::Exact(ImageFormat::Jpeg);
            let cut = "the file is cut off: it has no end-of-image marker";
            return Err(self.error(ImageError::Decoding(DecodingError::new(hint, cut))));
        }
        let decoder = reader.into_decoder().map_err(wrong)?;
        if decoder.total_bytes() > MAX_BYTES || size_of(&decoder).rgb_bytes() as u64 > MAX_BYTES {
            let limit = LimitError::from_kind(LimitErrorKind::InsufficientMemory);
            return Err(self.error(ImageError::Limits(limit)));
        }
        Ok(decoder)
    }

    fn is_jpeg(&self) -> bool {
        image::guess_format(&self.bytes).is_ok_and(|it| it == ImageFormat::Jpeg)
    }

    fn error(&self, source: ImageError) -> FootageError {
        FootageError::Image {
            path: self.path.to_path_buf(),
            source,
        }
    }
}

/// Decodes a JPEG file with libjpeg, whose rounding the reference programs used; `false` if it cannot.
///
/// Other decoders differ by a few grey levels in every seventh sample, which is enough to break ties of
/// gradient orientations differently: only 22 of 100 PARSE images then keep their detection to the cell.
/// The library reports errors by unwinding, which is caught here; the caller tries another decoder.
pub(crate) fn jpeg_into(bytes: &[u8], rgb: &mut [u8]) -> bool {
    let decode = || -> std::io::Result<Vec<u8>> {
        let mut lines = mozjpeg::Decompress::new_mem(bytes)?.rgb()?;
        let pixels = lines.read_scanlines::<u8>()?;
        lines.finish()?;
        Ok(pixels)
    };
    match std::panic::catch_unwind(decode) {
        Ok(Ok(pixels)) if pixels.len() == rgb.len() => {
            rgb.copy_from_slice(&pixels);
            true
        }
        _ => false,
    }
}

fn size_of(decoder: &impl ImageDecoder) -> Size {
    let (width, height) = decoder.dimensions();
    Size::new(width as usize, height as usize)
}

/// Whether the data of a JPEG file reaches its end-of-image marker (ITU-T T.81, B.1.1).
///
/// Decoders fill missing data with grey without an error. The segments in front of the data are
/// skipped, because a thumbnail in them has an end marker of its own.
pub(crate) fn jpeg_is_whole(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
        if marker == START_OF_SCAN {
            return bytes[at..].windows(2).any(|it| it == [0xff, 0xd9]);
        }
        // Markers may be padded with any number of fill bytes.
        at += if marker == 0xff {
            1
        } else {
            2 + usize::from(u16::from_be_bytes([high, low]))
        };
    }
    false
}
