//! A reduced picture as JPEG, for a page.

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

/// Longest side of a picture, in pixels.
pub(crate) const LONGEST: usize = 480;
/// Quality of the JPEG files, in percent.
const QUALITY: u8 = 72;
/// Number of bytes before the JPEG file in a message to the page.
const HEAD_BYTES: usize = 16;

/// Returns a message to the page with one picture. It contains 1, the view, whether poses are drawn in the picture, five zeros, the number
/// of the frame (64 bits, little endian), and a JPEG file. `None` if the picture has no pixels or cannot be encoded.
///
/// * `size`: width and height, in pixels.
/// * `rgb`: `width * height * 3` bytes.
/// * `is_drawn`: true if poses are already drawn in the picture.
pub(crate) fn message(
    view: usize,
    frame: u64,
    size: [usize; 2],
    rgb: &[u8],
    is_drawn: bool,
) -> Option<Vec<u8>> {
    let (small, pixels) = reduced(size, rgb)?;
    let [width, height] = [small[0] as u32, small[1] as u32];
    let mut out = vec![0; HEAD_BYTES];
    out[0] = 1;
    out[1] = u8::try_from(view).ok()?;
    out[2] = u8::from(is_drawn);
    out[8..HEAD_BYTES].copy_from_slice(&frame.to_le_bytes());
    let mut encoder = JpegEncoder::new_with_quality(&mut out, QUALITY);
    let encoded = encoder.encode(&pixels, width, height, ExtendedColorType::Rgb8);
    encoded.is_ok().then_some(out)
}

/// Reduces a picture by the smallest whole factor that makes it small enough; every pixel is the mean of a square.
fn reduced(size: [usize; 2], rgb: &[u8]) -> Option<([usize; 2], Vec<u8>)> {
    let [width, height] = size;
    let fits = width.checked_mul(height)?.checked_mul(3)? == rgb.len();
    if !fits || rgb.is_empty() {
        return None;
    }
    let by = width.max(height).div_ceil(LONGEST);
    if by == 1 {
        return Some((size, rgb.to_vec()));
    }
    let small = [(width / by).max(1), (height / by).max(1)];
    let mut pixels = Vec::with_capacity(small[0] * small[1] * 3);
    let mut sums = vec![0_u32; 3 * small[0]];
    for row in 0..small[1] {
        sums.fill(0);
        let rows = row * by..((row + 1) * by).min(height);
        let n_rows = rows.len();
        for from in rows {
            let line = &rgb[3 * width * from..3 * width * (from + 1)];
            for (sum, square) in sums.chunks_exact_mut(3).zip(line.chunks(3 * by)) {
                for pixel in square.chunks_exact(3) {
                    for (sum, value) in sum.iter_mut().zip(pixel) {
                        *sum += u32::from(*value);
                    }
                }
            }
        }
        let n = (n_rows * by.min(width)).max(1) as u32;
        pixels.extend(sums.iter().map(|sum| ((sum + n / 2) / n).min(255) as u8));
    }
    Some((small, pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_picture_is_shrunk_to_means_of_squares() {
        // Columns alternate between 0 and 200, with a width of 1000 pixels, so blocks of three by three pixels have a mean of 67 or 133.
        let rgb: Vec<u8> = (0..1000 * 6).flat_map(|i| [200 * (i % 2) as u8, 9, 255]).collect();
        let (size, small) = reduced([1000, 6], &rgb).unwrap();
        assert_eq!(size, [333, 2]);
        assert_eq!(small.len(), 333 * 2 * 3);
        assert_eq!(small[..6], [67, 9, 255, 133, 9, 255]);
        let (size, same) = reduced([2, 1], &[1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!((size, same), ([2, 1], vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(reduced([3, 1], &[1, 2, 3, 4, 5, 6]), None);
        assert_eq!(reduced([0, 0], &[]), None);
        assert_eq!(reduced([usize::MAX, 2], &[0]), None);
    }

    #[test]
    fn a_picture_message_contains_view_and_frame_before_the_file() {
        let rgb = vec![90; 40 * 30 * 3];
        let bytes = message(3, 0x0102_0304_0506, [40, 30], &rgb, true).unwrap();
        assert_eq!(bytes[..4], [1, 3, 1, 0]);
        assert_eq!(bytes[8..16], [6, 5, 4, 3, 2, 1, 0, 0]);
        let read = image::load_from_memory(&bytes[16..]).unwrap();
        assert_eq!([read.width(), read.height()], [40, 30]);
    }
}
