//! The orientation tag in an image file: EXIF in a segment of a JPEG file or in a chunk of a PNG file.

use image::metadata::Orientation;

/// Number of the entry for the orientation (EXIF 2.32, 4.6.4).
const ORIENTATION: u16 = 0x0112;
/// Type of an entry that contains 16-bit numbers.
const SHORT: u16 = 3;

/// Returns the orientation in the EXIF data of a JPEG or PNG file.
pub(super) fn orientation(file: &[u8]) -> Option<Orientation> {
    let exif = match file {
        [0xff, 0xd8, rest @ ..] => of_jpeg(rest)?,
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', rest @ ..] => of_png(rest)?,
        _ => return None,
    };
    Orientation::from_exif(u8::try_from(Tiff::read(exif)?.short(ORIENTATION)?).ok()?)
}

/// Returns the EXIF data in the segments before the data of a JPEG file (ITU-T T.81, B.1.1; EXIF 2.32, 4.7.2).
fn of_jpeg(mut rest: &[u8]) -> Option<&[u8]> {
    loop {
        match rest {
            // Markers may be padded with any number of fill bytes.
            [0xff, 0xff, ..] => rest = &rest[1..],
            [0xff, 0xda, ..] => return None,
            [0xff, marker, high, low, ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                let exif = rest.get(4..2 + length)?.strip_prefix(b"Exif\0\0");
                if let (0xe1, Some(exif)) = (*marker, exif) {
                    return Some(exif);
                }
                rest = &rest[2 + length..];
            }
            _ => return None,
        }
    }
}

/// Returns the data of the chunk `eXIf` of a PNG file (PNG 3, 11.3.4.5).
fn of_png(mut rest: &[u8]) -> Option<&[u8]> {
    const AROUND: usize = 12;
    loop {
        let length = u32::from_be_bytes(*rest.first_chunk()?) as usize;
        let data = rest.get(8..)?.get(..length)?;
        match &rest[4..8] {
            b"eXIf" => return Some(data),
            b"IEND" => return None,
            _ => rest = rest.get(AROUND + length..)?,
        }
    }
}

/// The first directory of a TIFF file, which is the format of EXIF data (TIFF 6.0, section 2).
struct Tiff<'a> {
    bytes: &'a [u8],
    is_little_endian: bool,
}

impl<'a> Tiff<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let is_little_endian = match bytes.first_chunk()? {
            b"II*\0" => true,
            b"MM\0*" => false,
            _ => return None,
        };
        Some(Self {
            bytes,
            is_little_endian,
        })
    }

    /// Returns the value of the entry with this number, if it is a single 16-bit number.
    fn short(&self, tag: u16) -> Option<u16> {
        const ENTRY: usize = 12;
        let first = self.u32_at(4)? as usize;
        let n_entries = usize::from(self.u16_at(first)?);
        let entries = (0..n_entries).map(|nth| first + 2 + nth * ENTRY);
        for at in entries {
            let (found, kind, count) =
                (self.u16_at(at)?, self.u16_at(at + 2)?, self.u32_at(at + 4)?);
            if (found, kind, count) == (tag, SHORT, 1) {
                return self.u16_at(at + 8);
            }
        }
        None
    }

    fn u16_at(&self, at: usize) -> Option<u16> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_little_endian {
            u16::from_le_bytes(bytes)
        } else {
            u16::from_be_bytes(bytes)
        })
    }

    fn u32_at(&self, at: usize) -> Option<u32> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_little_endian {
            u32::from_le_bytes(bytes)
        } else {
            u32::from_be_bytes(bytes)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{DynamicImage, ImageFormat};
    use proptest::prelude::*;

    use super::*;

    fn picture(format: ImageFormat) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let image = DynamicImage::new_rgb8(16, 8);
        image.write_to(&mut file, format).unwrap();
        file.into_inner()
    }

    #[test]
    fn a_tag_is_found_in_jpeg_and_png_files() {
        for format in [ImageFormat::Jpeg, ImageFormat::Png] {
            let plain = picture(format);
            assert_eq!(orientation(&plain), None);
            for value in 1..=8 {
                let tagged = testkit::exif::tagged(&plain, value);
                assert_eq!(orientation(&tagged), Orientation::from_exif(value));
                image::load_from_memory(&tagged).unwrap();
            }
            assert_eq!(orientation(&testkit::exif::tagged(&plain, 9)), None);
        }
        assert_eq!(orientation(&picture(ImageFormat::Bmp)), None);
    }

    #[test]
    fn both_byte_orders_are_read() {
        let little = b"II*\0\x08\0\0\0\x02\0\0\0\x03\0\x01\0\0\0\x09\0\0\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0";
        let big = b"MM\0*\0\0\0\x08\0\x02\0\0\0\x03\0\0\0\x01\0\x09\0\0\x01\x12\0\x03\0\0\0\x01\0\x06\0\0";
        for bytes in [&little[..], big] {
            let short = |bytes| Tiff::read(bytes)?.short(ORIENTATION);
            assert_eq!(short(bytes), Some(6));
            for length in 0..bytes.len() - 2 {
                assert_eq!(short(&bytes[..length]), None, "{length}");
            }
        }
    }

    proptest! {
        #[test]
        fn damaged_files_do_not_panic(
            is_png in any::<bool>(),
            at in 0_usize..200,
            value in any::<u8>(),
            length in 0_usize..300,
        ) {
            let format = if is_png { ImageFormat::Png } else { ImageFormat::Jpeg };
            let mut file = testkit::exif::tagged(&picture(format), 6);
            file.truncate(length.max(at + 1));
            if let Some(byte) = file.get_mut(at) {
                *byte = value;
            }
            let _found = orientation(&file);
        }
    }
}
