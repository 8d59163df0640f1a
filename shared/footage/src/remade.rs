//! Decodes the pictures of a stream that was kept in its original form, with an `ffmpeg` process.

use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex};

use crate::programs::version_of;
use crate::source::log::Log;
use crate::source::program::missing;
use crate::stream::{SHARE, outputs};
use crate::{FootageError, Size, StreamEnd};

/// A running decoder of pieces. Dropping this value kills the decoder.
#[derive(Debug)]
pub struct RemadeStream {
    name: String,
    /// Size of the kept pictures.
    size: Size,
    /// Size of the pictures that the decoder sends.
    sent_size: Size,
    child: StreamEnd,
    stdout: ChildStdout,
    log: Log,
}

impl RemadeStream {
    /// Starts a decoder.
    ///
    /// * `name`: name of the stream in error messages.
    /// * `pieces`: the bytes of a head, followed by the bytes of its pictures in order ([`Piece`](crate::Piece)). A separate thread reads
    ///   them.
    /// * `size`, `shrink`: size of the kept pictures, and the factor by which they are shrunk, which divides both sides.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::FfmpegMissing`] on failure.
    pub fn open(
        name: &str,
        pieces: impl Iterator<Item = Vec<u8>> + Send + 'static,
        size: Size,
        shrink: usize,
    ) -> Result<Self, FootageError> {
        let small = (shrink > 1).then(|| size.shrunk(shrink));
        let ffmpeg = PathBuf::from("ffmpeg");
        let not_started = |source| missing(&ffmpeg, name.as_ref(), source);
        let mut child = Command::new(&ffmpeg)
            .args([
                "-nostdin", "-v", "error", "-copyts", "-f", "matroska", "-i", "pipe:0",
            ])
            .args(outputs(&version_of(&ffmpeg), small))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(not_started)?;
        let no_pipe = || not_started(ErrorKind::BrokenPipe.into());
        let mut stdin = child.stdin.take().ok_or_else(no_pipe)?;
        let stdout = child.stdout.take().ok_or_else(no_pipe)?;
        let stderr = child.stderr.take().ok_or_else(no_pipe)?;
        let thread = std::thread::Builder::new().name("pieces".to_owned());
        let fed = thread.spawn(move || {
            // A decoder that has ended does not accept any more pieces.
            let mut pieces = pieces;
            pieces.all(|piece| stdin.write_all(&piece).is_ok());
        });
        fed.map_err(not_started)?;
        Ok(Self {
            name: name.to_owned(),
            size,
            sent_size: small.unwrap_or(size),
            child: StreamEnd(Arc::new(Mutex::new(child))),
            stdout,
            log: Log::follow(stderr).map_err(not_started)?,
        })
    }

    /// Reads the next picture into `rgb`. Returns its time in the stream, in nanoseconds; `None` at the end.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::Video`] if the picture cannot be decoded, or [`FootageError::SizeChanged`].
    ///
    /// # Panics
    ///
    /// Panics if the length of `rgb` does not match the size of a picture after shrinking.
    pub fn next_into(&mut self, rgb: &mut [u8]) -> Result<Option<i64>, FootageError> {
        assert_eq!(
            rgb.len(),
            self.sent_size.rgb_bytes(),
            "a picture is {} in RGB",
            self.sent_size
        );
        let failed = |message: String| FootageError::Video {
            path: self.name.clone().into(),
            message,
        };
        if self.stdout.read_exact(rgb).is_err() {
            self.child.end();
            return Ok(None);
        }
        let time = self.log.next_time();
        let time = time.ok_or_else(|| failed("the decoder gives no times".to_owned()))?;
        if time.bytes != (self.size.width * (self.size.height / SHARE)) as u64 {
            return Err(FootageError::SizeChanged {
                path: self.name.clone().into(),
                expected: self.size,
            });
        }
        Ok(Some((time.time_s * 1e9).round() as i64))
    }
}

impl Drop for RemadeStream {
    fn drop(&mut self) {
        self.child.end();
    }
}
