//! Converts pictures of cameras from their own formats to RGB.

use crate::Size;
use crate::source::{jpeg_into, jpeg_is_whole};

/// A pixel format of cameras that this crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    /// Each picture is a JPEG file.
    Jpeg,
    /// `Y U Y V` for two adjacent pixels.
    Yuyv,
    /// `U Y V Y` for two adjacent pixels.
    Uyvy,
    /// All `Y` values, followed by `U V` for every four pixels.
    Nv12,
    /// Brightness only.
    Grey,
    /// Red, green, blue.
    Rgb,
    /// Blue, green, red.
    Bgr,
}

impl PixelFormat {
    /// All formats, best first: first the formats with the fewest bytes, then the formats that lose the least information.
    pub const ALL: [Self; 7] = [
        Self::Jpeg,
        Self::Yuyv,
        Self::Uyvy,
        Self::Nv12,
        Self::Rgb,
        Self::Bgr,
        Self::Grey,
    ];

    /// Returns the four letters of the format in Linux.
    pub fn letters(self) -> [u8; 4] {
        *match self {
            Self::Jpeg => b"MJPG",
            Self::Yuyv => b"YUYV",
            Self::Uyvy => b"UYVY",
            Self::Nv12 => b"NV12",
            Self::Grey => b"GREY",
            Self::Rgb => b"RGB3",
            Self::Bgr => b"BGR3",
        }
    }

    /// Returns the format with these four letters. `JPEG` is also accepted for JPEG files.
    pub fn of_letters(letters: [u8; 4]) -> Option<Self> {
        let is_jpeg = letters == *b"JPEG";
        let of = |known: &Self| known.letters() == letters || (is_jpeg && *known == Self::Jpeg);
        Self::ALL.into_iter().find(of)
    }

    /// Converts a picture to RGB. Returns `false` if it is damaged, truncated or of another size.
    ///
    /// Brightness and colour are interpreted as BT.601 with values from 16 to 235, as used by webcams.
    ///
    /// * `bytes_per_row`: bytes from one row to the next; 0 for rows without a gap.
    /// * `rgb`: `width * height * 3` bytes; the content is undefined if the function returns `false`.
    pub fn to_rgb(self, bytes: &[u8], bytes_per_row: usize, size: Size, rgb: &mut [u8]) -> bool {
        if rgb.len() != size.rgb_bytes() || size.rgb_bytes() == 0 {
            return false;
        }
        let least = size.width * self.bytes_per_pixel();
        let stride = bytes_per_row.max(least);
        let n_rows = if self == Self::Nv12 {
            size.height + size.height.div_ceil(2)
        } else {
            size.height
        };
        if self == Self::Jpeg {
            return jpeg_is_whole(bytes) && jpeg_into(bytes, rgb);
        }
        if bytes.len() < stride * (n_rows - 1) + least {
            return false;
        }
        for (row, line) in rgb.chunks_exact_mut(3 * size.width).enumerate() {
            let from = &bytes[stride * row..];
            match self {
                Self::Yuyv => pairs(from, line, [0, 1, 2, 3]),
                Self::Uyvy => pairs(from, line, [1, 0, 3, 2]),
                Self::Nv12 => nv12(from, &bytes[stride * (size.height + row / 2)..], line),
                Self::Rgb => line.copy_from_slice(&from[..line.len()]),
                Self::Bgr => each(
                    line,
                    from.chunks_exact(3).map(|chunk| [chunk[2], chunk[1], chunk[0]]),
                ),
                Self::Grey | Self::Jpeg => each(line, from.iter().map(|from| [*from; 3])),
            }
        }
        true
    }

    fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Jpeg => 0,
            Self::Yuyv | Self::Uyvy => 2,
            Self::Nv12 | Self::Grey => 1,
            Self::Rgb | Self::Bgr => 3,
        }
    }
}

fn each(line: &mut [u8], pixels: impl Iterator<Item = [u8; 3]>) {
    for (to, from) in line.chunks_exact_mut(3).zip(pixels) {
        to.copy_from_slice(&from);
    }
}

/// Converts a row with two pixels in four bytes.
///
/// * `order`: indices of `Y`, `U`, the second `Y` and `V` in the four bytes.
fn pairs(from: &[u8], line: &mut [u8], [y0, u, y1, v]: [usize; 4]) {
    for (to, four) in line.chunks_mut(6).zip(from.chunks(4)) {
        let &[_, _, _, _] = four else {
            // If the width is odd, the colour information of the last pixel is incomplete.
            to.fill(four.get(y0).copied().unwrap_or(0));
            continue;
        };
        for (pixel, y) in to.chunks_exact_mut(3).zip([four[y0], four[y1]]) {
            pixel.copy_from_slice(&rgb_of(y, four[u], four[v]));
        }
    }
}

fn nv12(brightness: &[u8], colour: &[u8], line: &mut [u8]) {
    for (column, pixel) in line.chunks_exact_mut(3).enumerate() {
        let pair = column / 2 * 2;
        let at = |index: usize| colour.get(index).copied().unwrap_or(128);
        pixel.copy_from_slice(&rgb_of(brightness[column], at(pair), at(pair + 1)));
    }
}

/// Converts a pixel by BT.601, values from 16 to 235, rounded.
fn rgb_of(y: u8, u: u8, v: u8) -> [u8; 3] {
    let [y, u, v] = [i32::from(y) - 16, i32::from(u) - 128, i32::from(v) - 128];
    let to_byte = |value: i32| ((value + 128) >> 8).clamp(0, 255) as u8;
    [
        to_byte(298 * y + 409 * v),
        to_byte(298 * y - 100 * u - 208 * v),
        to_byte(298 * y + 516 * u),
    ]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rgb(format: PixelFormat, bytes: &[u8], stride: usize, size: Size) -> Option<Vec<u8>> {
        let mut rgb = vec![0; size.rgb_bytes()];
        let is_whole = format.to_rgb(bytes, stride, size, &mut rgb);
        is_whole.then_some(rgb)
    }

    #[test]
    fn black_white_and_red_are_converted_correctly() {
        let two = Size::new(2, 1);
        let of = |bytes: &[u8]| rgb(PixelFormat::Yuyv, bytes, 0, two).unwrap();
        assert_eq!(of(&[16, 128, 235, 128]), [0, 0, 0, 255, 255, 255]);
        // The red of the colour bars, from the table in BT.601.
        assert_eq!(of(&[81, 90, 81, 240]), [255, 0, 0, 255, 0, 0]);
        let uyvy = rgb(PixelFormat::Uyvy, &[90, 81, 240, 81], 0, two).unwrap();
        assert_eq!(uyvy, [255, 0, 0, 255, 0, 0]);
        let nv12 = rgb(
            PixelFormat::Nv12,
            &[81, 81, 81, 81, 90, 240],
            0,
            Size::new(2, 2),
        );
        assert_eq!(nv12.unwrap(), [255, 0, 0].repeat(4));
        let bgr = rgb(PixelFormat::Bgr, &[1, 2, 3, 4, 5, 6], 0, two).unwrap();
        assert_eq!(bgr, [3, 2, 1, 6, 5, 4]);
    }

    #[test]
    fn padding_between_rows_is_skipped() {
        let got = rgb(PixelFormat::Grey, &[1, 2, 99, 3, 4], 3, Size::new(2, 2)).unwrap();
        assert_eq!(got, [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]);
    }

    #[test]
    fn a_truncated_jpeg_file_counts_as_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.jpg");
        let red = [200, 30, 30].repeat(16 * 8);
        image::save_buffer(&file, &red, 16, 8, image::ColorType::Rgb8).unwrap();
        let bytes = std::fs::read(&file).unwrap();
        let of = |bytes: &[u8], size| rgb(PixelFormat::Jpeg, bytes, 0, size);
        let whole = of(&bytes, Size::new(16, 8)).unwrap();
        assert!(whole[0].abs_diff(200) < 4 && whole[1].abs_diff(30) < 4);
        assert_eq!(of(&bytes[..bytes.len() / 2], Size::new(16, 8)), None);
        assert_eq!(of(&bytes, Size::new(8, 8)), None, "another size");
        assert_eq!(of(&[], Size::new(16, 8)), None);
    }

    proptest! {
        #[test]
        fn any_number_of_bytes_is_decoded_or_refused(
            format in prop::sample::select(&PixelFormat::ALL[..]),
            bytes in prop::collection::vec(any::<u8>(), 0..200),
            stride in 0_usize..40, width in 1_usize..9, height in 1_usize..6,
        ) {
            let got = rgb(format, &bytes, stride, Size::new(width, height));
            let enough = (stride.max(3 * width)) * height * 2;
            if format != PixelFormat::Jpeg && bytes.len() >= enough {
                prop_assert!(got.is_some());
            }
        }
    }
}
