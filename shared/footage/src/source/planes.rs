//! Shrunk pictures that the decoder sends as planes of brightness and colour, and their conversion to RGB.
//!
//! `ffmpeg` takes longer to convert a picture that it shrinks to RGB than to shrink it.

use serde_json::Value;

/// Number of fractional bits of the factors.
const BITS: u32 = 14;
const HALF: i32 = 1 << (BITS - 1);
/// Brightness of black, and the value of both colours for grey.
const BLACK: i32 = 16;
const GREY: i32 = 128;
/// Factor of brightness: 16 to 235 become 0 to 255.
const BRIGHTNESS: i32 = factor(255.0 / 219.0);
/// Pixel formats of video that can be sent as planes without loss: 8 bits, with 16 for black and 235 for white.
const FORMATS: [&str; 3] = ["yuv420p", "yuv422p", "nv12"];

/// The standard by which red, green and blue follow from brightness and colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standard {
    /// ITU-R BT.601, which is also assumed for videos that name no standard, as by `ffmpeg`.
    Bt601,
    /// ITU-R BT.709.
    Bt709,
}

/// Factors of the colours `[blue - brightness, red - brightness]`, in units of `2^-BITS`.
struct Factors {
    red: i32,
    green: [i32; 2],
    blue: i32,
}

const fn factor(value: f64) -> i32 {
    (value * (1 << BITS) as f64 + 0.5) as i32
}

impl Factors {
    /// Returns the factors for the weights of red and blue in the brightness (ITU-R BT.601-7, section 2.5.1; BT.709-6, item 3.2).
    const fn new(red: f64, blue: f64) -> Self {
        let scale = 255.0 / 112.0;
        let green = 1.0 - red - blue;
        Self {
            red: factor(scale * (1.0 - red)),
            green: [
                factor(scale * (1.0 - blue) * blue / green),
                factor(scale * (1.0 - red) * red / green),
            ],
            blue: factor(scale * (1.0 - blue)),
        }
    }
}

impl Standard {
    /// Returns the standard of a stream as described by `ffprobe`; `None` if its pictures cannot be sent as planes.
    pub(super) fn of_stream(stream: &Value) -> Option<Self> {
        let text = |key: &str| stream[key].as_str().unwrap_or("unknown");
        let is_known =
            FORMATS.contains(&text("pix_fmt")) && ["unknown", "tv"].contains(&text("color_range"));
        match text("color_space") {
            _ if !is_known => None,
            "unknown" | "smpte170m" | "bt470bg" => Some(Self::Bt601),
            "bt709" => Some(Self::Bt709),
            _ => None,
        }
    }

    /// Converts a picture of three full-size planes (`yuv444p`) to RGB.
    ///
    /// # Panics
    ///
    /// Panics if the lengths differ.
    pub(super) fn to_rgb(self, planes: &[u8], rgb: &mut [u8]) {
        const BT601: Factors = Factors::new(0.299, 0.114);
        const BT709: Factors = Factors::new(0.2126, 0.0722);
        let factors = match self {
            Self::Bt601 => BT601,
            Self::Bt709 => BT709,
        };
        assert_eq!(planes.len(), rgb.len(), "both have three bytes per pixel");
        let (brightness, colours) = planes.split_at(rgb.len() / 3);
        let (blues, reds) = colours.split_at(rgb.len() / 3);
        let colours = blues.iter().zip(reds);
        let pixels = rgb.as_chunks_mut::<3>().0.iter_mut();
        for ((pixel, brightness), (blue, red)) in pixels.zip(brightness).zip(colours) {
            let grey = (i32::from(*brightness) - BLACK) * BRIGHTNESS + HALF;
            let [blue, red] = [blue, red].map(|colour| i32::from(*colour) - GREY);
            let green = factors.green[0] * blue + factors.green[1] * red;
            let channels = [
                grey + factors.red * red,
                grey - green,
                grey + factors.blue * blue,
            ];
            *pixel = channels.map(|channel| (channel >> BITS).clamp(0, 255) as u8);
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn colours_become_the_red_green_and_blue_of_their_standard() {
        // Black, white, grey, and the primaries of BT.601 in 8 bits.
        let colours = [
            [16, 128, 128],
            [235, 128, 128],
            [126, 128, 128],
            [81, 90, 240],
            [145, 54, 34],
            [41, 240, 110],
        ];
        let planes: Vec<u8> =
            (0..3).flat_map(|plane| colours.map(|colour| colour[plane])).collect();
        let mut rgb = [0; 18];
        Standard::Bt601.to_rgb(&planes, &mut rgb);
        let due = [
            [0, 0, 0],
            [255, 255, 255],
            [128, 128, 128],
            [255, 0, 0],
            [0, 255, 0],
            [0, 0, 255],
        ];
        for (got, due) in rgb.chunks(3).zip(due) {
            for (got, due) in got.iter().zip(due) {
                assert!((i32::from(*got) - due).abs() <= 2, "{rgb:?}");
            }
        }
        let mut other = [0; 18];
        Standard::Bt709.to_rgb(&planes, &mut other);
        assert_eq!(other[..9], rgb[..9], "greys are the same");
        assert_ne!(other[9..], rgb[9..]);
    }

    #[test]
    fn only_videos_with_a_known_standard_and_range_are_sent_as_planes() {
        let stream = |format: &str, space: Option<&str>, range: Option<&str>| {
            let stream = json!({ "pix_fmt": format, "color_space": space, "color_range": range });
            Standard::of_stream(&stream)
        };
        assert_eq!(stream("yuv420p", None, None), Some(Standard::Bt601));
        let named = stream("nv12", Some("bt709"), Some("tv"));
        assert_eq!(named, Some(Standard::Bt709));
        assert_eq!(stream("yuv420p", None, Some("pc")), None);
        assert_eq!(stream("yuvj420p", None, None), None);
        assert_eq!(stream("yuv420p10le", None, None), None);
        assert_eq!(stream("yuv420p", Some("bt2020nc"), Some("tv")), None);
    }
}
