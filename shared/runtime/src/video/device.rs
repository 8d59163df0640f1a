//! A video device: opens it, queries it, and sets its format.

use std::fs;
use std::io;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{FileType, Mode, OFlags, major, open, stat};

use super::raw::{self, Raw, Request};
use super::{FourCc, VideoError};

/// Description that a device reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VideoAbout {
    /// Name of the camera.
    pub card: String,
    /// Name of the kernel's driver.
    pub driver: String,
    /// Port that the device is plugged into.
    pub bus: String,
}

/// Settings requested from a device. A setting that is `None` or empty stays unchanged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VideoWish {
    /// Pixel formats, best first. The first one that the device offers is used.
    pub formats: Vec<FourCc>,
    /// Width and height, in pixels.
    pub size: Option<[u32; 2]>,
    /// Pictures per second.
    pub rate_hz: Option<f64>,
}

/// Mode in which a device delivers pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VideoMode {
    /// Format of the pixels.
    pub format: FourCc,
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// Bytes from one row to the next; 0 for formats without rows.
    pub bytes_per_row: u32,
    /// Pictures per second, if the device reports the rate.
    pub rate_hz: Option<f64>,
}

/// Checks, before a path is opened, that it is a video device, by its kind and number. Opening some other devices would have side effects.
fn check_kind(path: &Path) -> Result<(), VideoError> {
    const VIDEO: u32 = 81;
    let status = stat(path).map_err(|error| VideoError::Open {
        path: path.to_owned(),
        source: error.into(),
    })?;
    let why = match FileType::from_raw_mode(status.st_mode) {
        FileType::CharacterDevice if major(status.st_rdev) == VIDEO => return Ok(()),
        FileType::CharacterDevice | FileType::BlockDevice => "it is a device of another kind",
        FileType::Directory => "it is a folder",
        FileType::RegularFile => "it is a file",
        _ => "it is not a device",
    };
    Err(VideoError::NoCamera {
        path: path.to_owned(),
        why: why.to_owned(),
    })
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
    /// Returns a [`VideoError`] if the device does not exist, may not be opened, or is not a camera.
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        check_kind(path)?;
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC | OFlags::NOCTTY;
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
                "it does not capture pictures in a single plane",
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

    /// Returns the description that the device reports.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::NoCamera`] on failure.
    pub fn about(&self) -> Result<VideoAbout, VideoError> {
        let it = self.capability()?;
        Ok(VideoAbout {
            card: text(&it.card),
            driver: text(&it.driver),
            bus: text(&it.bus_info),
        })
    }

    /// Returns the path with which the device was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// Sends a request to the device. An error names the request.
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

    /// Returns the mode in which the device currently delivers pictures.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::Request`] on failure.
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
}

/// Converts seconds per picture to pictures per second.
pub(super) fn rate_hz([numerator, denominator]: [u32; 2]) -> Option<f64> {
    let is_one = numerator > 0 && denominator > 0;
    is_one.then(|| f64::from(denominator) / f64::from(numerator))
}

/// Returns a text of the kernel, which ends with a zero.
pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// Returns the video devices of this machine, such as `/dev/video0`, in the order of their numbers. Some of them may not be cameras.
///
/// # Errors
///
/// Fails if the folder of devices cannot be read.
pub fn video_devices() -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir("/dev")? {
        let name = entry?.file_name();
        let number = name.to_str().and_then(|text| text.strip_prefix("video")?.parse::<u32>().ok());
        found.extend(number.map(|number| (number, Path::new("/dev").join(name))));
    }
    found.sort();
    Ok(found.into_iter().map(|device| device.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_that_are_not_cameras_are_refused_with_the_reason() {
        let absent = VideoDevice::open(Path::new("/dev/video4711")).unwrap_err();
        assert!(matches!(absent, VideoError::Open { .. }), "{absent}");
        let other = VideoDevice::open(Path::new("/dev/null")).unwrap_err();
        assert!(
            other.to_string().contains("/dev/null is not a camera"),
            "{other}"
        );
    }

    #[test]
    fn kernel_strings_end_at_the_first_zero_byte() {
        assert_eq!(text(b"uvcvideo\0\0\0x"), "uvcvideo");
        assert_eq!(text(b"full"), "full");
        assert_eq!(
            rate_hz([1001, 30_000]).map(|value| (value * 100.0).round()),
            Some(2997.0)
        );
        assert_eq!(rate_hz([0, 5]), None);
    }
}
