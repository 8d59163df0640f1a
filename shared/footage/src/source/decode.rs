//! Decodes one image file to 8-bit RGB.

use std::io::Cursor;
use std::path::Path;

use image::error::{DecodingError, ImageFormatHint, LimitError, LimitErrorKind};
use image::{ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use crate::{FootageError, Size};

/// The largest image decoded, bytes: a header of 30 bytes may promise any size.
const MAX_BYTES: u64 = 1 << 29;

/// An image file in memory. What it holds is told by its content, never by its name.
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

    /// The pixels, row major: grey is replicated, alpha dropped, 16 bits rounded to 8, orientation tags
    /// ignored.
    ///
    /// `rgb` must have the size of the image.
    pub(super) fn decode_into(&self, rgb: &mut [u8]) -> Result<(), FootageError> {
        let decoder = self.decoder()?;
        let wrong = |it| self.wrong(it);
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
        let wrong = |it| self.wrong(it);
        let reader = ImageReader::new(Cursor::new(&self.bytes[..]))
            .with_guessed_format()
            .map_err(|it| self.wrong(ImageError::IoError(it)))?;
        if reader.format() == Some(ImageFormat::Jpeg) && !jpeg_is_whole(&self.bytes) {
            let hint = ImageFormatHint::Exact(ImageFormat::Jpeg);
            let cut = "the file is cut off: it has no end-of-image marker";
            return Err(self.wrong(ImageError::Decoding(DecodingError::new(hint, cut))));
        }
        let decoder = reader.into_decoder().map_err(wrong)?;
        if decoder.total_bytes() > MAX_BYTES || size_of(&decoder).rgb_bytes() as u64 > MAX_BYTES {
            let limit = LimitError::from_kind(LimitErrorKind::InsufficientMemory);
            return Err(self.wrong(ImageError::Limits(limit)));
        }
        Ok(decoder)
    }

    fn is_jpeg(&self) -> bool {
        image::guess_format(&self.bytes).is_ok_and(|it| it == ImageFormat::Jpeg)
    }

    fn wrong(&self, source: ImageError) -> FootageError {
        FootageError::Image {
            path: self.path.to_path_buf(),
            source,
        }
    }
}

/// Decodes a JPEG file with libjpeg, whose rounding the reference programs saw; `false` if it cannot.
///
/// Other decoders differ by a few grey levels in every seventh sample, which is enough to turn ties of
/// gradient orientations: of 100 PARSE images only 22 then keep their detection to the cell.
/// The library reports errors by unwinding, which ends here; the caller tries another decoder.
fn jpeg_into(bytes: &[u8], rgb: &mut [u8]) -> bool {
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
/// Decoders fill what is missing with grey and say nothing. The segments in front of the data are
/// stepped over, as a thumbnail in them has an end marker of its own.
fn jpeg_is_whole(bytes: &[u8]) -> bool {
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
