//! Decodes one image file to 8-bit RGB.

use std::io::Cursor;
use std::path::Path;

use image::error::{DecodingError, ImageFormatHint, LimitError, LimitErrorKind};
use image::metadata::Orientation;
use image::{ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::exif;
use crate::turn::{Rotation, Turn};
use crate::{FootageError, Size};

/// Maximum size of a decoded image, in bytes. Without a limit, a header of 30 bytes may claim any size.
const MAX_BYTES: u64 = 1 << 29;

/// Options for reading images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Reading {
    pub(super) rotation: Rotation,
    /// Depth of 16-bit images that use fewer bits.
    pub(super) depth: Option<Depth>,
}

/// Number of bits that images with 16 bits per colour use, and the largest value that was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Depth {
    /// Largest value that was found.
    pub brightest: u16,
    /// Number of bits for this value, as used by cameras: 8, 10, 12 or 14.
    pub bits: u32,
}

impl Depth {
    /// Returns the depth of images in which this is the largest value; `None` if they use all 16 bits, or if all values are 0.
    pub(super) fn of(brightest: u16) -> Option<Self> {
        let bits = [8, 10, 12, 14].into_iter().find(|i| brightest < 1 << i)?;
        (brightest > 0).then_some(Self { brightest, bits })
    }

    fn in_8_bits(self, value: u16) -> u8 {
        let most = (1 << self.bits) - 1;
        ((u32::from(value) * 255 + most / 2) / most).min(255) as u8
    }
}

fn has_16_bits(color: ColorType) -> bool {
    matches!(
        color,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16
    )
}

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

    /// Returns the width and height, from the header.
    pub(super) fn size(&self) -> Result<Size, FootageError> {
        let decoder = self.decoder()?;
        Ok(size_of(&decoder))
    }

    /// Returns the orientation tag (EXIF). A tag that cannot be read is treated as missing.
    pub(super) fn tag(&self) -> Turn {
        Turn(exif::orientation(&self.bytes).unwrap_or(Orientation::NoTransforms))
    }

    /// Returns the size and the rotated pixels, row major. Grey values are copied to all channels, alpha is dropped, and 16 bits are
    /// rounded to 8.
    pub(super) fn decode(&self, reading: Reading) -> Result<(Size, Vec<u8>), FootageError> {
        let stored = self.size()?;
        let mut rgb = vec![0; stored.rgb_bytes()];
        self.decode_into(&mut rgb, reading.depth)?;
        Ok(reading.rotation.turn(self.tag()).apply(stored, rgb))
    }

    /// Returns the size of the rotated picture, from the header.
    pub(super) fn turned_size(&self, rotation: Rotation) -> Result<Size, FootageError> {
        Ok(rotation.turn(self.tag()).size(self.size()?))
    }

    /// Returns the largest value of an image with 16 bits per colour; `None` for other images.
    pub(super) fn brightest(&self) -> Result<Option<u16>, FootageError> {
        let decoder = self.decoder()?;
        if !has_16_bits(decoder.color_type()) {
            return Ok(None);
        }
        let image = DynamicImage::from_decoder(decoder).map_err(|source| self.error(source))?;
        Ok(image.into_rgb16().iter().copied().max())
    }

    fn decode_into(&self, rgb: &mut [u8], depth: Option<Depth>) -> Result<(), FootageError> {
        let decoder = self.decoder()?;
        let wrong = |source| self.error(source);
        if self.is_jpeg() && jpeg_into(&self.bytes, rgb) {
            return Ok(());
        }
        if decoder.color_type() == ColorType::Rgb8 {
            return decoder.read_image(rgb).map_err(wrong);
        }
        let depth = depth.filter(|_| has_16_bits(decoder.color_type()));
        let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
        if let Some(depth) = depth {
            for (to, from) in rgb.iter_mut().zip(image.into_rgb16().iter()) {
                *to = depth.in_8_bits(*from);
            }
        } else {
            rgb.copy_from_slice(image.into_rgb8().as_raw());
        }
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
        image::guess_format(&self.bytes).is_ok_and(|format| format == ImageFormat::Jpeg)
    }

    fn error(&self, source: ImageError) -> FootageError {
        FootageError::Image {
            path: self.path.to_path_buf(),
            source,
        }
    }
}

/// Decodes a JPEG file with libjpeg, which rounds in the same way as the reference programs. Returns `false` if it cannot be decoded.
///
/// Other decoders differ by a few grey levels in every seventh sample. This is enough to change how ties between gradient orientations are
/// broken: with another decoder, the detection stays in exactly the same cell in only 22 of 100 PARSE images. The library reports errors by
/// unwinding. This function catches them, and the caller tries another decoder.
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

/// Returns true if the data of a JPEG file extends to its end-of-image marker (ITU-T T.81, B.1.1).
///
/// Decoders fill missing data with grey without an error. The segments before the data are skipped, because a thumbnail in them has an end
/// marker of its own.
pub(crate) fn jpeg_is_whole(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
        if marker == START_OF_SCAN {
            return bytes[at..].windows(2).any(|pair| pair == [0xff, 0xd9]);
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

/// Returns true if the file is a sequence of JPEG pictures of one size, as cameras write Motion JPEG without a container.
///
/// In the files of photographs, other pictures may follow the first one (previews, depth maps, gain maps). These either are smaller, or are
/// listed in a segment of the first picture (`MPF`, CIPA DC-007).
pub(super) fn is_jpeg_stream(bytes: &[u8]) -> bool {
    let Some(first) = JpegHead::read(bytes) else {
        return false;
    };
    // Within the data, a byte of this value is followed only by 0 or by a restart marker.
    let data = bytes.get(first.data..).unwrap_or_default();
    let next = data.windows(3).position(|window| window == [0xff, 0xd8, 0xff]);
    let second = next.and_then(|at| JpegHead::read(&data[at..]));
    !first.has_others && second.is_some_and(|head| head.sides == first.sides)
}

/// Content of the segments before the data of a JPEG picture.
struct JpegHead {
    sides: [u8; 4],
    /// True if a segment lists further pictures.
    has_others: bool,
    /// Index at which the data begin.
    data: usize,
}

impl JpegHead {
    fn read(bytes: &[u8]) -> Option<Self> {
        let (mut sides, mut has_others, mut at) = (None, false, 2);
        while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
            let length = 2 + usize::from(u16::from_be_bytes([high, low]));
            match marker {
                // Markers may be padded with any number of fill bytes.
                0xff => {
                    at += 1;
                    continue;
                }
                0xda => {
                    return Some(Self {
                        sides: sides?,
                        has_others,
                        data: at + length,
                    });
                }
                // These are all frame headers. The excluded markers are Huffman tables, extensions and arithmetic coding.
                0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&marker) => {
                    sides = bytes.get(at + 5..at + 9)?.first_chunk().copied();
                }
                0xe2 => has_others |= bytes.get(at + 4..at + 7) == Some(b"MPF"),
                _ => {}
            }
            at += length;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg(width: u32, height: u32) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let image = DynamicImage::new_rgb8(width, height);
        image.write_to(&mut file, ImageFormat::Jpeg).unwrap();
        file.into_inner()
    }

    #[test]
    fn concatenated_pictures_of_one_size_are_a_stream() {
        let (one, small) = (jpeg(32, 16), jpeg(16, 8));
        let cut = one[..one.len() - 8].to_vec();
        for stream in [
            [&one[..], &one].concat(),
            [&one[..], &[0; 7], &one, &one].concat(),
            [&cut[..], &one].concat(),
        ] {
            assert!(is_jpeg_stream(&stream));
        }
        let mut photograph = [&one[..2], &[0xff, 0xe2, 0, 6], b"MPF\0"].concat();
        photograph.extend([&one[2..], &one].concat());
        for still in [
            one.clone(),
            cut,
            [&one[..], &small].concat(),
            photograph,
            vec![0xff, 0xd8],
            Vec::new(),
        ] {
            assert!(!is_jpeg_stream(&still));
        }
    }

    #[test]
    fn unused_bits_are_detected_from_the_largest_value() {
        let bits = |brightest| Depth::of(brightest).map(|depth| depth.bits);
        assert_eq!(
            [200, 1023, 4000, 16_000].map(bits),
            [8, 10, 12, 14].map(Some)
        );
        assert_eq!([0, 16_384, 65_535].map(bits), [None; 3]);
        let depth = Depth::of(4000).unwrap();
        assert_eq!(
            [0, 2048, 4095, 9000].map(|i| depth.in_8_bits(i)),
            [0, 128, 255, 255]
        );
    }
}
