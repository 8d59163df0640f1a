//! Encodes frames as JPEG, and decodes them.

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{ExtendedColorType, ImageDecoder as _, ImageError};

/// Encodes a frame as JPEG.
///
/// * `rgb`: `width * height * 3` bytes.
/// * `quality`: 1 to 100.
pub(crate) fn encode(rgb: &[u8], size: [u32; 2], quality: u8) -> Result<Vec<u8>, ImageError> {
    let mut out = Vec::with_capacity(rgb.len() / 8);
    let mut encoder = JpegEncoder::new_with_quality(&mut out, quality);
    encoder.encode(rgb, size[0], size[1], ExtendedColorType::Rgb8)?;
    Ok(out)
}

/// Decodes the frame from a JPEG file. Returns `None` if it does not have this size, or is not in colour.
///
/// The size is checked before anything is decoded, because a few bytes can claim to be a very large picture.
pub(crate) fn decode(jpeg: &[u8], size: [u32; 2]) -> Option<Vec<u8>> {
    let decoder = JpegDecoder::new(std::io::Cursor::new(jpeg)).ok()?;
    let (width, height) = decoder.dimensions();
    let n_bytes = width as usize * height as usize * 3;
    if [width, height] != size || decoder.total_bytes() != n_bytes as u64 {
        return None;
    }
    let mut rgb = vec![0; n_bytes];
    decoder.read_image(&mut rgb).ok()?;
    Some(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture([width, height]: [u32; 2]) -> Vec<u8> {
        let pixel = |x: u32, y: u32| [(x * 3) as u8, (y * 2) as u8, (x + y) as u8];
        let rows = (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y)));
        rows.collect()
    }

    #[test]
    fn a_decoded_frame_is_nearly_equal_to_the_original() {
        let size = [48, 32];
        let rgb = picture(size);
        let jpeg = encode(&rgb, size, 90).unwrap();
        let got = decode(&jpeg, size).unwrap();
        let worst = rgb.iter().zip(&got).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst.unwrap() < 16, "{worst:?}");
    }

    #[test]
    fn bytes_that_are_not_a_picture_of_the_expected_size_are_refused() {
        let jpeg = encode(&picture([48, 32]), [48, 32], 90).unwrap();
        assert!(decode(&jpeg, [32, 48]).is_none());
        assert!(decode(&jpeg[..jpeg.len() / 8], [48, 32]).is_none());
        assert!(decode(b"", [48, 32]).is_none());
        assert!(decode(b"no picture", [48, 32]).is_none());
    }
}
