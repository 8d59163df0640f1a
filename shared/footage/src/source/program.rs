//! Names of files as arguments of ffmpeg and ffprobe.

use std::io;
use std::path::Path;

use crate::{FootageError, Size};

/// Returns the filter that shrinks pictures to a size. Each pixel is the mean of the pixels that it covers.
pub(crate) fn shrink_filter(Size { width, height }: Size) -> String {
    format!("scale={width}:{height}:flags=area+accurate_rnd+full_chroma_int")
}

/// Returns the options that ffmpeg needs to read a file. A sequence of JPEG pictures is a video, regardless of the file's name.
pub(crate) fn input_options(path: &Path) -> &'static [&'static str] {
    use std::io::Read as _;
    let mut head = [0; 3];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    if read.is_ok() && head == [0xff, 0xd8, 0xff] {
        return &["-f", "mjpeg"];
    }
    &[]
}

/// Returns the name of a file as an argument of ffmpeg, protected against misinterpretation of names such as `concat:x` and `-x`.
pub(crate) fn input_name(path: &Path) -> std::ffi::OsString {
    let mut name = std::ffi::OsString::from("file:");
    name.push(path);
    name
}

pub(crate) fn missing(executable: &Path, path: &Path, source: io::Error) -> FootageError {
    FootageError::FfmpegMissing {
        executable: executable.to_path_buf(),
        path: path.to_path_buf(),
        source,
    }
}
