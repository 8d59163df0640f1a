//! Sources that are not files: cameras, streams, devices.

use std::fs::FileType;
use std::os::unix::fs::FileTypeExt as _;

/// Whether a text is the address of a camera or a stream: `rtsp://...`, `udp://...`, `http://...`, `v4l2:...`.
pub fn is_live(text: &str) -> bool {
    what(text).is_some()
}

/// The kind of source that the scheme of an address stands for; `None` for a file.
pub(super) fn what(text: &str) -> Option<&'static str> {
    let (scheme, _) = text.split_once(':')?;
    match scheme.to_ascii_lowercase().as_str() {
        "rtsp" | "rtsps" | "rtmp" | "rtp" | "udp" | "tcp" | "srt" | "mms" | "whep" => {
            Some("a live stream")
        }
        "http" | "https" | "ftp" | "sftp" | "s3" => Some("an address on a network"),
        "v4l2" | "video4linux" | "dshow" | "avfoundation" => Some("a live camera"),
        "file" => Some("an address"),
        _ => None,
    }
}

/// The name of a file type that is neither a file nor a folder.
pub(super) fn kind(file_type: FileType) -> &'static str {
    if file_type.is_char_device() || file_type.is_block_device() {
        "a device"
    } else if file_type.is_fifo() {
        "a pipe"
    } else {
        "no file"
    }
}

/// What to do instead, for the message.
pub(super) fn instead(path: &str) -> String {
    if let Some(file) = path.strip_prefix("file://") {
        return format!("name the file without file://: {file}");
    }
    let input = match path.split_once(':') {
        Some(("v4l2" | "video4linux", device)) => format!("-f v4l2 -i {device}"),
        _ if path.starts_with("/dev/") => format!("-f v4l2 -i {path}"),
        _ => format!("-i {path}"),
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
        ] {
            assert!(is_live(text), "{text}");
        }
        for text in [
            "a.mp4",
            "C:a.mp4",
            "frames/%05d.png",
            "synth://humaneva",
            "12:30.mp4",
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
