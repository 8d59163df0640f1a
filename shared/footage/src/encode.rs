//! Writes pictures to a video through an `ffmpeg` process.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

use crate::source::log::Log;
use crate::source::program::missing;
use crate::{FootageError, Size};

/// Quality of H.264, from 0 (lossless) to 51; the next constant is the quality of MPEG-4, from 1 (best) to 31.
const H264_CRF: &str = "20";
const MPEG4_QUALITY: &str = "3";

/// A video that is being written: an MP4 file with H.264 if `ffmpeg` supports H.264, otherwise with MPEG-4.
///
/// The file is complete only after [`finish`](Self::finish) has returned. Dropping the writer before that kills the process.
#[derive(Debug)]
pub struct VideoWriter {
    path: PathBuf,
    size: Size,
    child: Child,
    /// Closed at the end, which tells the encoder to finish.
    stdin: Option<ChildStdin>,
    log: Log,
}

impl VideoWriter {
    /// Starts the encoder. An existing file is replaced.
    ///
    /// * `path`: the file, which may have any name; its content is MP4.
    /// * `size`: size of the pictures. If a side has an odd number of pixels, a black row or column is added, as the format requires.
    /// * `ffmpeg`: the executable.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::FfmpegMissing`] or [`FootageError::BadRate`].
    pub fn create(
        path: &Path,
        size: Size,
        rate_hz: f64,
        ffmpeg: &Path,
    ) -> Result<Self, FootageError> {
        if !(rate_hz.is_finite() && rate_hz > 0.0) {
            return Err(FootageError::BadRate { rate_hz });
        }
        let not_started = |source| missing(ffmpeg, path, source);
        let encoders = Command::new(ffmpeg)
            .args(["-v", "error", "-encoders"])
            .output()
            .map_err(not_started)?;
        let has_h264 = String::from_utf8_lossy(&encoders.stdout).contains("libx264");
        let codec = if has_h264 {
            ["-c:v", "libx264", "-preset", "veryfast", "-crf", H264_CRF].as_slice()
        } else {
            &["-c:v", "mpeg4", "-q:v", MPEG4_QUALITY]
        };
        let mut child = Command::new(ffmpeg)
            .args([
                "-nostdin", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
            ])
            .args(["-video_size", &format!("{}x{}", size.width, size.height)])
            .args(["-framerate", &rate_hz.to_string(), "-i", "pipe:0"])
            .args([
                "-vf",
                "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                "-pix_fmt",
                "yuv420p",
            ])
            .args(codec)
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(path)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(not_started)?;
        let no_pipe = || not_started(std::io::ErrorKind::BrokenPipe.into());
        let stdin = child.stdin.take().ok_or_else(no_pipe)?;
        let stderr = child.stderr.take().ok_or_else(no_pipe)?;
        Ok(Self {
            path: path.to_path_buf(),
            size,
            child,
            stdin: Some(stdin),
            log: Log::follow(stderr).map_err(not_started)?,
        })
    }

    /// Adds a picture: RGB, row major.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::Encode`] with the encoder's message if the encoder has ended.
    ///
    /// # Panics
    ///
    /// Panics if `rgb` is not `width * height * 3` bytes.
    pub fn add(&mut self, rgb: &[u8]) -> Result<(), FootageError> {
        assert_eq!(
            rgb.len(),
            self.size.rgb_bytes(),
            "a picture is {}",
            self.size
        );
        let stdin = self.stdin.as_mut();
        match stdin.map(|stdin| stdin.write_all(rgb)) {
            Some(Ok(())) => Ok(()),
            Some(Err(error)) => Err(self.failed(&error.to_string())),
            None => Err(self.failed("it has ended")),
        }
    }

    /// Ends the video, and waits until the file is complete.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::Encode`] on failure.
    pub fn finish(mut self) -> Result<(), FootageError> {
        drop(self.stdin.take());
        match self.child.wait() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(self.failed(&status.to_string())),
            Err(error) => Err(self.failed(&error.to_string())),
        }
    }

    /// Returns an error with the encoder's message, or with `why` if there is no message.
    fn failed(&mut self, why: &str) -> FootageError {
        drop(self.stdin.take());
        let said = self.log.finish();
        FootageError::Encode {
            path: self.path.clone(),
            message: if said.is_empty() {
                why.to_owned()
            } else {
                said
            },
        }
    }
}

impl Drop for VideoWriter {
    fn drop(&mut self) {
        // If the process has already ended, both calls fail, and there is nothing left to do.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Source, SourceSpec};

    fn has_ffmpeg() -> bool {
        Command::new("ffmpeg").arg("-version").output().is_ok()
    }

    #[test]
    fn a_written_video_is_read_back_with_an_even_size() {
        if !has_ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.part");
        let size = Size::new(65, 48);
        let mut video = VideoWriter::create(&path, size, 12.5, Path::new("ffmpeg")).unwrap();
        for nth in 0..5_u8 {
            video.add(&vec![50 * nth; size.rgb_bytes()]).unwrap();
        }
        video.finish().unwrap();
        let mut source = Source::open(&SourceSpec::new(path.to_string_lossy())).unwrap();
        assert_eq!(source.info().size, Size::new(66, 48));
        assert_eq!(
            (source.info().n_frames, source.info().frame_rate_hz),
            (5, Some(12.5))
        );
        for nth in 0..5_u8 {
            let frame = source.next_frame().unwrap().unwrap();
            let grey = i32::from(frame.rgb[3 * (66 * 20 + 20)]);
            assert!((grey - i32::from(50 * nth)).abs() < 4, "{grey}");
        }
    }

    #[test]
    fn an_unwritable_path_is_named_with_the_reason() {
        if !has_ffmpeg() {
            return;
        }
        let (path, size) = (Path::new("/nowhere/at/all.mp4"), Size::new(16, 16));
        let mut video = VideoWriter::create(path, size, 25.0, Path::new("ffmpeg")).unwrap();
        let picture = vec![0; size.rgb_bytes()];
        let added = (0..1000).try_for_each(|_| video.add(&picture));
        let error = added.and_then(|()| video.finish()).unwrap_err().to_string();
        assert!(error.contains("/nowhere/at/all.mp4"), "{error}");
        assert!(error.contains("No such file"), "{error}");
        let none = VideoWriter::create(path, size, 25.0, Path::new("no-such-ffmpeg"));
        assert!(matches!(none, Err(FootageError::FfmpegMissing { .. })));
    }
}
