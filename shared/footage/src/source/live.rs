//! Sources that are not files: cameras, streams, devices.

use core::fmt;
use std::fs::FileType;
use std::os::unix::fs::FileTypeExt as _;
use std::path::PathBuf;

use super::password::without_passwords;

/// Location of a live camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LiveAddress {
    /// A video device of this machine: `/dev/video0`.
    Device(PathBuf),
    /// A stream on a network: `rtsp://...`.
    Stream(String),
}

impl LiveAddress {
    /// Parses `v4l2:/dev/video0`, a path under `/dev`, or the address of a stream (`rtsp`, `udp`, `http` and similar). Returns `None` for
    /// any other text, which is taken as the path of footage.
    ///
    /// ```
    /// use footage::LiveAddress;
    ///
    /// let device = LiveAddress::parse("v4l2:/dev/video0");
    /// assert_eq!(device, Some(LiveAddress::Device("/dev/video0".into())));
    /// assert_eq!(LiveAddress::parse("walk.mp4"), None);
    /// ```
    pub fn parse(text: &str) -> Option<Self> {
        if text.starts_with("/dev/") {
            return Some(Self::Device(text.into()));
        }
        let (scheme, rest) = text.split_once(':')?;
        match scheme.to_ascii_lowercase().as_str() {
            "v4l2" | "video4linux" => Some(Self::Device(rest.into())),
            "rtsp" | "rtsps" | "rtmp" | "rtp" | "udp" | "tcp" | "srt" | "http" | "https"
                if rest.starts_with("//") =>
            {
                Some(Self::Stream(text.to_owned()))
            }
            _ => None,
        }
    }
}

impl fmt::Display for LiveAddress {
    /// Writes the address without any user name or password in it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device(path) => write!(f, "{}", path.display()),
            Self::Stream(address) => f.write_str(&without_passwords(address)),
        }
    }
}

/// Returns true if a text is the address of a camera or a stream: `rtsp://...`, `udp://...`, `http://...`, `v4l2:...`,
/// `/dev/video0`.
pub fn is_live(text: &str) -> bool {
    LiveAddress::parse(text).is_some()
}

/// Returns true if a text is an address of any kind, even of a kind that cannot be read. Such a text is not the path of a file.
pub fn is_address(text: &str) -> bool {
    what(text).is_some()
}

/// Returns what kind of source the scheme of an address stands for; `None` for a file.
pub(super) fn what(text: &str) -> Option<&'static str> {
    match LiveAddress::parse(text) {
        Some(LiveAddress::Device(_)) => return Some("a live camera"),
        Some(LiveAddress::Stream(_)) => return Some("a live stream"),
        None => {}
    }
    let (scheme, _) = text.split_once(':')?;
    match scheme.to_ascii_lowercase().as_str() {
        "mms" | "whep" => Some("a live stream"),
        "ftp" | "sftp" | "s3" => Some("an address on a network"),
        "dshow" | "avfoundation" => Some("a live camera"),
        "file" => Some("an address"),
        _ => None,
    }
}

/// Returns the name of a file type that is neither a file nor a folder.
pub(super) fn kind(file_type: FileType) -> &'static str {
    if file_type.is_char_device() || file_type.is_block_device() {
        "a device"
    } else if file_type.is_fifo() {
        "a pipe"
    } else {
        "no file"
    }
}

/// Returns what to use instead, for the message.
pub(super) fn instead(path: &str) -> String {
    if let Some(file) = path.strip_prefix("file://") {
        return format!("name the file without file://: {file}");
    }
    let input = match path.split_once(':') {
        Some(("v4l2" | "video4linux", device)) => {
            format!("-f v4l2 -i {}", failure::wording::shell(device))
        }
        _ if path.starts_with("/dev/") => format!("-f v4l2 -i {}", failure::wording::shell(path)),
        _ => format!("-i {}", failure::wording::shell(path)),
    };
    format!("record it first (`ffmpeg {input} -t 60 left.mp4`), and name that file")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_and_devices_are_distinguished_from_files() {
        for text in [
            "rtsp://10.0.0.5/a",
            "UDP://@:5000",
            "http://a/b.mp4",
            "v4l2:/dev/video0",
            "/dev/v4l/by-id/usb-046d_C920-video-index0",
        ] {
            assert!(is_live(text), "{text}");
        }
        for text in [
            "a.mp4",
            "C:a.mp4",
            "frames/%05d.png",
            "synth://humaneva",
            "12:30.mp4",
            "udp:x.mp4",
            "",
        ] {
            assert!(!is_live(text), "{text}");
        }
    }

    #[test]
    fn the_advice_names_the_source() {
        for (path, words) in [
            ("rtsp://c/1", "ffmpeg -i rtsp://c/1 "),
            ("v4l2:/dev/video2", "ffmpeg -f v4l2 -i /dev/video2 "),
            ("/dev/video0", "ffmpeg -f v4l2 -i /dev/video0 "),
            ("file:///a/b.mp4", "without file://: /a/b.mp4"),
        ] {
            assert!(instead(path).contains(words), "{}", instead(path));
        }
    }
}
