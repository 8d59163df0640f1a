//! Settings of a live camera: address, format, size, rate, controls.

use std::collections::BTreeMap;

use failure::{ExitKind, Fault};
use footage::{FootageError, LiveAddress, PixelFormat, Size, StreamSpec, Transport};
use messages::Status;
use runtime::{FourCc, VideoDevice, VideoError, VideoMode, VideoWish};

/// A live camera, with the requested settings.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveCamera {
    /// Address of the camera.
    pub address: LiveAddress,
    /// Pixel format of a device; `None` for any supported format.
    pub format: Option<String>,
    /// Width and height in pixels; `None` to keep the camera's setting.
    pub size: Option<[u32; 2]>,
    /// Pictures per second; `None` to keep the camera's setting.
    pub rate_hz: Option<f64>,
    /// Controls to set on a device, by name.
    pub controls: BTreeMap<String, i64>,
    /// Transport of an RTSP camera's packets.
    pub transport: Option<Transport>,
    /// True to use the times that an RTSP camera states for its pictures, as long as they are plausible.
    pub has_own_clock: bool,
    /// Maximum factor by which the decoder of a stream may shrink the pictures ([`footage::SourceSpec::most_shrink`]).
    pub most_shrink: usize,
}

/// Error if a live camera cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The stream fails.
    #[error(transparent)]
    Stream(#[from] FootageError),
    /// The device fails.
    #[error(transparent)]
    Device(#[from] VideoError),
    /// The format is not supported.
    #[error(
        "the format {format:?} is not supported; supported formats: {}",
        known()
    )]
    Format {
        /// Requested format, or the current format of the device.
        format: String,
    },
    /// The stream does not give its rate.
    #[error("{address} does not state its frame rate: set `frame_rate_hz` of the camera")]
    NoRate {
        /// Address without a password.
        address: String,
    },
    /// No picture has arrived for some time.
    #[error("{address} sends no pictures")]
    Silent {
        /// Address without a password.
        address: String,
    },
    /// Another camera now has the address of this camera.
    #[error("{address} is a different camera now: {found}, expected {expected}")]
    Another {
        /// Address of the camera.
        address: String,
        /// Camera that has the address now.
        found: String,
        /// Camera that had the address before.
        expected: String,
    },
}

impl Fault for LiveError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::Device(error) => error.kind(),
            Self::Format { .. } | Self::NoRate { .. } => ExitKind::Config,
            _ => ExitKind::Input,
        }
    }
}

impl LiveError {
    /// Returns the reason why there are no pictures, for the messages.
    pub(crate) fn status(&self) -> Status {
        match self {
            Self::Stream(FootageError::SizeChanged { .. })
            | Self::Device(VideoError::NotOffered { .. })
            | Self::Format { .. } => Status::WRONG_SIZE,
            Self::Silent { .. } => Status::NO_FRAME,
            _ => Status::UNPLUGGED,
        }
    }
}

fn known() -> String {
    let all = PixelFormat::ALL.map(|pixel_format| FourCc(pixel_format.letters()).to_string());
    all.join(", ")
}

impl LiveCamera {
    /// Returns a camera that keeps its current settings.
    pub fn new(address: LiveAddress) -> Self {
        Self {
            address,
            format: None,
            size: None,
            rate_hz: None,
            controls: BTreeMap::new(),
            transport: None,
            has_own_clock: true,
            most_shrink: 1,
        }
    }

    /// Returns the size and rate of the pictures. A device is configured as requested. A stream is queried, unless both size and rate are
    /// given.
    ///
    /// # Errors
    ///
    /// Fails with [`LiveError`] if the camera cannot be used.
    pub fn look(&self) -> Result<(Size, f64), LiveError> {
        let (size, rate_hz) = match &self.address {
            LiveAddress::Device(path) => {
                let mode = self.set(&VideoDevice::open(path)?, self.size)?.0;
                (size_of(mode), mode.rate_hz)
            }
            LiveAddress::Stream(address) => match (self.size, self.rate_hz) {
                (Some([width, height]), Some(rate)) => {
                    (Size::new(width as usize, height as usize), Some(rate))
                }
                _ => self.stream(address).probe()?,
            },
        };
        let rate_hz = self.rate_hz.or(rate_hz).ok_or_else(|| LiveError::NoRate {
            address: self.address.to_string(),
        })?;
        Ok((size, rate_hz))
    }

    /// Configures a device as requested.
    pub(super) fn set(
        &self,
        device: &VideoDevice,
        size: Option<[u32; 2]>,
    ) -> Result<(VideoMode, PixelFormat), LiveError> {
        let known = PixelFormat::ALL.map(|pixel_format| FourCc(pixel_format.letters()));
        let formats = match &self.format {
            None => known.to_vec(),
            Some(text) => {
                let format =
                    FourCc::parse(text).filter(|value| PixelFormat::of_letters(value.0).is_some());
                let unknown = || LiveError::Format {
                    format: text.clone(),
                };
                vec![format.ok_or_else(unknown)?]
            }
        };
        for (name, value) in &self.controls {
            device.set_control(name, *value)?;
        }
        let mode = device.set(&VideoWish {
            formats,
            size,
            rate_hz: self.rate_hz,
        })?;
        let pixels = PixelFormat::of_letters(mode.format.0);
        let unknown = || LiveError::Format {
            format: mode.format.to_string(),
        };
        Ok((mode, pixels.ok_or_else(unknown)?))
    }

    /// Returns true if the camera is read over HTTP.
    pub(super) fn is_http(&self) -> bool {
        let LiveAddress::Stream(address) = &self.address else {
            return false;
        };
        let scheme = address.split(':').next().unwrap_or_default();
        ["http", "https"].iter().any(|name| scheme.eq_ignore_ascii_case(name))
    }

    pub(super) fn stream(&self, address: &str) -> StreamSpec {
        StreamSpec {
            transport: self.transport,
            most_shrink: self.most_shrink,
            ..StreamSpec::new(address)
        }
    }

    /// Returns the factor by which pictures of a size are shrunk before they are delivered.
    pub(crate) fn shrink(&self, size: Size) -> usize {
        match &self.address {
            LiveAddress::Device(_) => 1,
            LiveAddress::Stream(_) => size.divisor(self.most_shrink),
        }
    }
}

pub(super) fn size_of(mode: VideoMode) -> Size {
    let [width, height] = mode.size.map(|side| side as usize);
    Size::new(width, height)
}
