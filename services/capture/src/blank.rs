//! Grey frames in place of the pictures of a camera that has only keypoints. There is one frame for each frame of the keypoints.

use core::fmt;

use footage::{FootageError, FrameView, Size, SourceSpec};

use crate::info::FeedInfo;

/// Scheme of the addresses.
const SCHEME: &str = "blank://";
/// Brightness of all pixels.
const GREY: u8 = 128;
/// Longest side of a frame, in pixels. `[capture]` in a deployment has the same limits as these constants.
const MAX_SIDE: usize = 16_384;
/// Maximum number of frames.
const MOST_FRAMES: u64 = 1_000_000_000_000;
/// Lowest and highest frame rate, per second.
const RATES_HZ: [f64; 2] = [0.001, 1e5];

/// Grey frames as the source of a camera, such as `blank://1920x1080?frames=70&rate=60`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blank {
    /// Size of every frame.
    pub size: Size,
    /// Number of frames.
    pub n_frames: u64,
    /// Frames per second.
    pub rate_hz: f64,
}

/// Error for an invalid `blank://` URL.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BlankError {
    /// A part of the address is missing or unknown.
    #[error("expected an address such as `blank://1920x1080?frames=70&rate=60`: {what}")]
    Layout {
        /// Description of the mistake.
        what: String,
    },
    /// A number is out of range.
    #[error("`{key}` is {got}, expected {expected}")]
    Value {
        /// Name of the number.
        key: &'static str,
        /// Value in the address.
        got: String,
        /// Range of accepted values.
        expected: String,
    },
}

impl Blank {
    /// Returns true if a source is a `blank://` URL.
    pub fn is_blank(source: &str) -> bool {
        source.starts_with(SCHEME)
    }

    /// Parses an address.
    ///
    /// # Errors
    ///
    /// Fails with [`BlankError`], which describes the mistake.
    pub fn parse(address: &str) -> Result<Self, BlankError> {
        let layout = |what: &str| BlankError::Layout {
            what: what.to_owned(),
        };
        let rest = address.strip_prefix(SCHEME);
        let rest = rest.ok_or_else(|| layout("the address does not begin with `blank://`"))?;
        let (size, options) = rest.split_once('?').unwrap_or((rest, ""));
        let sides = size.split_once('x');
        let (width, height) = sides.ok_or_else(|| layout("width and height are missing"))?;
        let [mut n_frames, mut rate_hz] = [None, None];
        for option in options.split('&').filter(|part| !part.is_empty()) {
            match option.split_once('=') {
                Some(("frames", value)) => n_frames = Some(value),
                Some(("rate", value)) => rate_hz = Some(value),
                _ => return Err(layout(&format!("`{option}` is not `frames` or `rate`"))),
            }
        }
        let n_frames = n_frames.ok_or_else(|| layout("`frames` is missing"))?;
        let rate_hz = rate_hz.ok_or_else(|| layout("`rate` is missing"))?;
        Ok(Self {
            size: Size::new(
                within("width", width, [1, MAX_SIDE])?,
                within("height", height, [1, MAX_SIDE])?,
            ),
            n_frames: within("frames", n_frames, [1, MOST_FRAMES])?,
            rate_hz: within("rate", rate_hz, RATES_HZ)?,
        })
    }
}

impl fmt::Display for Blank {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            size,
            n_frames,
            rate_hz,
        } = self;
        write!(f, "{SCHEME}{size}?frames={n_frames}&rate={rate_hz}")
    }
}

fn within<T: core::str::FromStr + PartialOrd + fmt::Display>(
    key: &'static str,
    text: &str,
    [least, most]: [T; 2],
) -> Result<T, BlankError> {
    let number = text.parse::<T>().ok();
    let number = number.filter(|number| *number >= least && *number <= most);
    number.ok_or_else(|| BlankError::Value {
        key,
        got: format!("{:?}", text.chars().take(32).collect::<String>()),
        expected: format!("{least} to {most}"),
    })
}

/// The grey frames, one after the other.
#[derive(Debug)]
pub struct BlankFeed {
    pub(crate) info: FeedInfo,
    rate_hz: f64,
    /// Index of the next frame, and number of frames left.
    index: u64,
    step: u64,
    n_left: u64,
    pub(crate) rgb: Vec<u8>,
}

impl BlankFeed {
    /// Returns the properties of the frames that `spec` selects.
    pub(crate) fn look(blank: &Blank, spec: &SourceSpec) -> Result<FeedInfo, FootageError> {
        let n_frames = spec.n_delivered(blank.n_frames)?;
        let rate_hz = blank.rate_hz / spec.step as f64;
        Ok(FeedInfo::plain(blank.size, n_frames, rate_hz))
    }

    pub(crate) fn open(blank: &Blank, spec: &SourceSpec) -> Result<Self, FootageError> {
        let info = Self::look(blank, spec)?;
        Ok(Self {
            info,
            rate_hz: blank.rate_hz,
            index: spec.start,
            step: spec.step,
            n_left: info.n_frames,
            rgb: vec![GREY; blank.size.rgb_bytes()],
        })
    }

    pub(crate) fn next_frame(&mut self) -> Option<FrameView<'_>> {
        let index = self.index;
        (self.skip(1) == 1).then_some(FrameView {
            index,
            time_s: Some(index as f64 / self.rate_hz),
            rgb: &self.rgb,
        })
    }

    pub(crate) fn skip(&mut self, n: u64) -> u64 {
        let n = n.min(self.n_left);
        self.n_left -= n;
        self.index = self.index.saturating_add(n.saturating_mul(self.step));
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ADDRESS: &str = "blank://64x48?frames=7&rate=29.97";

    #[test]
    fn an_address_is_written_in_the_form_in_which_it_is_read() {
        let blank = Blank::parse(ADDRESS).unwrap();
        assert_eq!((blank.size, blank.n_frames), (Size::new(64, 48), 7));
        assert_eq!(blank.to_string(), ADDRESS);
        let other = Blank::parse("blank://64x48?rate=29.97&frames=7");
        assert_eq!(other, Ok(blank));
        assert!(Blank::is_blank(ADDRESS) && !Blank::is_blank("blank.mp4"));
    }

    #[test]
    fn impossible_addresses_are_refused_with_the_reason() {
        for (address, words) in [
            ("blank.mp4", "does not begin with `blank://`"),
            ("blank://?frames=1&rate=1", "width and height are missing"),
            ("blank://64x48?rate=1", "`frames` is missing"),
            ("blank://64x48?frames=1", "`rate` is missing"),
            ("blank://64x48?frames=1&rate=1&x=2", "`x=2` is not"),
            ("blank://0x48?frames=1&rate=1", "`width` is \"0\""),
            (
                "blank://64x99999?frames=1&rate=1",
                "`height` is \"99999\", expected 1 to 16384",
            ),
            ("blank://64x48?frames=0&rate=1", "`frames` is \"0\""),
            ("blank://64x48?frames=1&rate=NaN", "`rate` is \"NaN\""),
            ("blank://64x48?frames=1&rate=-1", "`rate` is \"-1\""),
        ] {
            let refused = Blank::parse(address).unwrap_err().to_string();
            assert!(refused.contains(words), "{address}: {refused}");
        }
    }
}
