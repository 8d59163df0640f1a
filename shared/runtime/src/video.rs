//! Video devices of Linux (V4L2): their capabilities, and their pictures with the times and numbers of the kernel.
//!
//! Reading order: [`VideoDevice`] (open, query, set), [`VideoStream`] (its pictures).

mod device;
mod error;
mod list;
mod raw;
mod set;
mod stream;

use core::fmt;

pub use device::{VideoAbout, VideoDevice, VideoMode, VideoWish, video_devices};
pub use error::VideoError;
pub use list::{VideoControl, VideoFormat, VideoSize};
pub use stream::{VideoPicture, VideoStream};

/// The four letters of a pixel format, such as `YUYV` or `MJPG`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FourCc(pub [u8; 4]);

impl FourCc {
    /// Parses the four letters and converts them to upper case; `mjpeg` and `jpeg` become `MJPG`. Returns `None` for other texts.
    pub fn parse(text: &str) -> Option<Self> {
        let upper = text.to_ascii_uppercase();
        let letters = match upper.as_str() {
            "MJPEG" => "MJPG",
            "GREY" | "GRAY" => "GREY",
            other => other,
        };
        let bytes = letters.as_bytes();
        let is_plain = bytes.iter().all(u8::is_ascii_graphic);
        let padded: [u8; 4] = match bytes.len() {
            3 => [bytes[0], bytes[1], bytes[2], b' '],
            4 => [bytes[0], bytes[1], bytes[2], bytes[3]],
            _ => return None,
        };
        is_plain.then_some(Self(padded))
    }

    fn of_number(number: u32) -> Self {
        Self(number.to_le_bytes())
    }

    fn number(self) -> u32 {
        u32::from_le_bytes(self.0)
    }
}

impl fmt::Display for FourCc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.0.escape_ascii().to_string();
        f.write_str(text.trim_end())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_have_the_names_that_users_write() {
        for (text, expected) in [
            ("mjpeg", Some(*b"MJPG")),
            ("yuyv", Some(*b"YUYV")),
            ("Y16", Some(*b"Y16 ")),
            ("gray", Some(*b"GREY")),
            ("", None),
            ("h264x", None),
            ("a b c", None),
        ] {
            assert_eq!(FourCc::parse(text).map(|value| value.0), expected, "{text}");
        }
        assert_eq!(FourCc(*b"Y16 ").to_string(), "Y16");
        assert_eq!(
            FourCc::of_number(FourCc(*b"MJPG").number()),
            FourCc(*b"MJPG")
        );
    }
}
