//! A video device: opened, asked what it is, set to a format.

use std::fs;
use std::io;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags, open};

use super::raw::{self, Raw, Request};
use super::{FourCc, VideoError, VideoFormat, VideoSize};

/// What a device says that it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VideoAbout {
    /// Name of the camera.
    pub card: String,
    /// The kernel's driver.
    pub driver: String,
    /// Where it is plugged in.
    pub bus: String,
}

/// What is wanted of a device; what is not given stays as the device has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VideoWish {
    /// Formats, the best first; the first that the device has is taken.
    pub formats: Vec<FourCc>,
    /// Width and height, pixels.
    pub size: Option<[u32; 2]>,
    /// Pictures per second.
    pub rate_hz: Option<f64>,
}

/// How a device delivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VideoMode {
    /// Format of the pixels.
    pub format: FourCc,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// From one row to the next, bytes; 0 where there are no rows.
    pub bytes_per_row: u32,
    /// Pictures per second, where the device tells.
    pub rate_hz: Option<f64>,
}

/// An open video device.
#[derive(Debug)]
pub struct VideoDevice {
    fd: OwnedFd,
    path: PathBuf,
}

impl VideoDevice {
    /// Opens a device that can stream pictures.
    ///
    /// # Errors
    ///
    /// [`VideoError`]: it is not there, may not be opened, or is no camera.
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let fd = open(path, flags, Mode::empty()).map_err(|error| VideoError::Open {
            path: path.to_owned(),
            source: error.into(),
        })?;
        let it = Self {
            fd,
            path: path.to_owned(),
        };
        let capability = it.capability()?;
        let caps = if capability.capabilities & raw::CAP_DEVICE_CAPS == 0 {
            capability.capabilities
        } else {
            capability.device_caps
        };
        let wanted = [
            (
                raw::CAP_VIDEO_CAPTURE,
                "it captures no pictures in one plane",
            ),
            (raw::CAP_STREAMING, "it cannot stream"),
        ];
        match wanted.into_iter().find(|(bit, _)| caps & bit == 0) {
            None => Ok(it),
            Some((_, why)) => Err(VideoError::NoCamera {
                path: path.to_owned(),
                why: why.to_owned(),
            }),
        }
    }

    fn capability(&self) -> Result<raw::Capability, VideoError> {
        let mut capability = raw::Capability::default();
        let asked = raw::ask(self.fd(), raw::QUERYCAP, &mut capability);
        asked.map_err(|error| VideoError::NoCamera {
            path: self.path.clone(),
            why: error.to_string(),
        })?;
        Ok(capability)
    }

    /// What it says that it is.
    ///
    /// # Errors
    ///
    /// [`VideoError::NoCamera`].
    pub fn about(&self) -> Result<VideoAbout, VideoError> {
        let it = self.capability()?;
        Ok(VideoAbout {
            card: text(&it.card),
            driver: text(&it.driver),
            bus: text(&it.bus_info),
        })
    }

    /// The path that it was opened by.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// Asks, and names what was asked for in the error.
    pub(super) fn ask<T: Raw>(
        &self,
        request: Request,
        what: &'static str,
        it: &mut T,
    ) -> Result<(), VideoError> {
        raw::ask(self.fd(), request, it).map_err(|source| VideoError::Request {
            path: self.path.clone(),
            what,
            source,
        })
    }

    /// How it delivers now.
    ///
    /// # Errors
    ///
    /// [`VideoError::Request`].
    pub fn mode(&self) -> Result<VideoMode, VideoError> {
        let mut format = raw::Format::default();
        self.ask(raw::G_FMT, "tell its format", &mut format)?;
        let mut parameters = raw::StreamParameters::default();
        let has_rate = raw::ask(self.fd(), raw::G_PARM, &mut parameters).is_ok();
        let seconds = [parameters.numerator, parameters.denominator];
        Ok(VideoMode {
            format: FourCc::of_number(format.pixels),
            size: [format.width, format.height],
            bytes_per_row: format.bytes_per_line,
            rate_hz: has_rate.then(|| rate_hz(seconds)).flatten(),
        })
    }

    /// Sets format, size and rate; returns how it delivers from now on.
    ///
    /// # Errors
    ///
    /// [`VideoError::NotOffered`] with what it offers where it takes something else; [`VideoError::Request`].
    pub fn set(&self, wish: &VideoWish) -> Result<VideoMode, VideoError> {
        let offered = self.formats()?;
        let now = self.mode()?;
        let has = |it: &FourCc| offered.iter().any(|offer| offer.format == *it);
        let format = match &wish.formats[..] {
            [] => now.format,
            wanted => *wanted.iter().find(|it| has(it)).ok_or_else(|| {
                let names: Vec<String> = wanted.iter().map(ToString::to_string).collect();
                self.not_offered("format", names.join(" or "), names_of(&offered))
            })?,
        };
        let size = wish.size.unwrap_or_else(|| {
            let own = offered.iter().find(|it| it.format == format);
            own.and_then(|it| it.nearest(now.size)).unwrap_or(now.size)
        });
        self.set_format(format, size, &offered)?;
        if let Some(rate) = wish.rate_hz {
            self.set_rate(rate, format, size, &offered)?;
        }
        self.mode()
    }

    fn set_format(
        &self,
        format: FourCc,
        size: [u32; 2],
        offered: &[VideoFormat],
    ) -> Result<(), VideoError> {
        let mut set = raw::Format {
            width: size[0],
            height: size[1],
            pixels: format.number(),
            ..raw::Format::default()
        };
        self.ask(raw::S_FMT, "take a format", &mut set)?;
        if set.pixels != format.number() {
            return Err(self.not_offered("format", format.to_string(), names_of(offered)));
        }
        if [set.width, set.height] != size {
            let sizes = offered.iter().filter(|it| it.format == format);
            let sizes: Vec<String> = sizes
                .flat_map(|it| &it.sizes)
                .map(VideoSize::text)
                .collect();
            let wanted = format!("{}x{} in {format}", size[0], size[1]);
            return Err(self.not_offered("size", wanted, sizes.join(", ")));
        }
        Ok(())
    }

    /// Sets the rate that is nearest, which may differ by 2 in 100: 29.97 where 30 is asked for.
    fn set_rate(
        &self,
        rate: f64,
        format: FourCc,
        size: [u32; 2],
        offered: &[VideoFormat],
    ) -> Result<(), VideoError> {
        const TOLERANCE: f64 = 0.02;
        let mut parameters = raw::StreamParameters {
            numerator: 1_000_000,
            denominator: (rate * 1e6).round() as u32,
            ..raw::StreamParameters::default()
        };
        let asked = raw::ask(self.fd(), raw::S_PARM, &mut parameters);
        let set = rate_hz([parameters.numerator, parameters.denominator]);
        let fits = |it: f64| (it / rate - 1.0).abs() <= TOLERANCE;
        if asked.is_ok() && set.is_some_and(fits) {
            return Ok(());
        }
        let own = offered.iter().find(|it| it.format == format);
        let rates = own.map_or_else(Vec::new, |it| it.rates_at(size));
        let rates: Vec<String> = rates.iter().map(|it| format!("{it:.2}")).collect();
        let offered = if rates.is_empty() {
            set.map_or_else(|| "no choice".to_owned(), |it| format!("{it:.2}"))
        } else {
            rates.join(", ")
        };
        let wanted = format!("{rate} a second at {}x{} in {format}", size[0], size[1]);
        Err(self.not_offered("rate", wanted, offered))
    }

    fn not_offered(&self, what: &'static str, wanted: String, offered: String) -> VideoError {
        VideoError::NotOffered {
            path: self.path.clone(),
            what,
            wanted,
            offered,
        }
    }
}

fn names_of(offered: &[VideoFormat]) -> String {
    let names: Vec<String> = offered.iter().map(|it| it.format.to_string()).collect();
    names.join(", ")
}

/// Pictures per second of seconds per picture.
pub(super) fn rate_hz([numerator, denominator]: [u32; 2]) -> Option<f64> {
    let is_one = numerator > 0 && denominator > 0;
    is_one.then(|| f64::from(denominator) / f64::from(numerator))
}

/// A text of the kernel, which ends with a zero.
pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|it| *it == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// The video devices of this machine, in the order of their numbers: `/dev/video0`. Some of them may be no cameras.
///
/// # Errors
///
/// The folder of devices cannot be read.
pub fn video_devices() -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir("/dev")? {
        let name = entry?.file_name();
        let number = name
            .to_str()
            .and_then(|it| it.strip_prefix("video")?.parse::<u32>().ok());
        found.extend(number.map(|it| (it, Path::new("/dev").join(name))));
    }
    found.sort();
    Ok(found.into_iter().map(|it| it.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_camera_is_refused_with_the_reason() {
        let absent = VideoDevice::open(Path::new("/dev/video4711")).unwrap_err();
        assert!(matches!(absent, VideoError::Open { .. }), "{absent}");
        let other = VideoDevice::open(Path::new("/dev/null")).unwrap_err();
        assert!(
            other.to_string().contains("/dev/null is no camera"),
            "{other}"
        );
    }

    #[test]
    fn texts_of_the_kernel_end_at_the_zero() {
        assert_eq!(text(b"uvcvideo\0\0\0x"), "uvcvideo");
        assert_eq!(text(b"full"), "full");
        assert_eq!(
            rate_hz([1001, 30_000]).map(|it| (it * 100.0).round()),
            Some(2997.0)
        );
        assert_eq!(rate_hz([0, 5]), None);
    }
}
