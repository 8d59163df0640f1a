//! A video, decoded by the `ffmpeg` executable at the other end of a pipe.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use super::log::Log;
use super::probe::{Probe, input_name, missing, probe};
use crate::{FootageError, SourceSpec};

/// A running decoder. It is killed when this is dropped; should this process die without dropping
/// anything, the decoder ends at its next write, as nobody holds the other end of the pipe.
#[derive(Debug)]
pub(super) struct Video {
    path: PathBuf,
    pub(super) probe: Probe,
    /// Frames that should come, from the index of the container.
    pub(super) n_frames: u64,
    /// Frames that should come, from the duration in the header.
    n_promised: u64,
    n_read: u64,
    child: Child,
    stdout: ChildStdout,
    log: Log,
}

impl Video {
    pub(super) fn open(path: &Path, spec: &SourceSpec) -> Result<Self, FootageError> {
        let probe = probe(path, spec)?;
        let n_frames = spec.n_delivered(probe.n_frames)?;
        let n_promised = spec.n_delivered(probe.n_promised)?;
        let not_started = |source| missing(&spec.ffmpeg, path, source);
        let mut child = Command::new(&spec.ffmpeg)
            .args(["-nostdin", "-v", "error", "-noautorotate", "-i"])
            .arg(input_name(path))
            .args(["-map", "0:v:0"])
            .args(frame_choice(spec))
            .arg(if probe.has_fps_mode {
                "-fps_mode"
            } else {
                "-vsync"
            })
            .args(["passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(not_started)?;
        let no_pipe = || not_started(ErrorKind::BrokenPipe.into());
        let stdout = child.stdout.take().ok_or_else(no_pipe)?;
        let stderr = child.stderr.take().ok_or_else(no_pipe)?;
        Ok(Self {
            path: path.to_path_buf(),
            probe,
            n_frames,
            n_promised,
            n_read: 0,
            child,
            stdout,
            log: Log::follow(stderr).map_err(not_started)?,
        })
    }

    /// Reads the next frame; `false` at the end of a video that came whole.
    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> Result<bool, FootageError> {
        let mut filled = 0;
        while filled < rgb.len() {
            match self.stdout.read(&mut rgb[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(it) if it.kind() == ErrorKind::Interrupted => {}
                Err(source) => {
                    return Err(FootageError::Io {
                        path: self.path.clone(),
                        source,
                    });
                }
            }
        }
        if filled == rgb.len() {
            self.n_read += 1;
            return Ok(true);
        }
        self.check_end(filled > 0)?;
        Ok(false)
    }

    /// Tells a video that is over from one that is cut off.
    ///
    /// Damage is what the decoder complains about *and* what costs frames: many a good video makes it
    /// complain, and some containers count a frame or two that are never shown. Without a complaint, a
    /// tenth of the frames may be missing: it takes the header's duration for that of the pictures
    /// only in a complaint, because sound may be longer.
    fn check_end(&mut self, is_partial: bool) -> Result<(), FootageError> {
        let message = self.log.finish();
        let status = self.child.wait().map_err(|source| FootageError::Io {
            path: self.path.clone(),
            source,
        })?;
        if self.n_read == 0 {
            let message = if message.is_empty() {
                format!("no frame could be decoded ({status})")
            } else {
                message
            };
            return Err(FootageError::Video {
                path: self.path.clone(),
                message,
            });
        }
        let n_expected = self.n_promised;
        let complains = !message.is_empty() && self.n_read < n_expected;
        let is_short = self.n_read < self.n_frames - self.n_frames / 10;
        if complains || is_partial || is_short || !status.success() {
            return Err(FootageError::VideoTruncated {
                path: self.path.clone(),
                n_read: self.n_read,
                n_expected,
                message: if message.is_empty() {
                    format!("the decoder says nothing ({status})")
                } else {
                    message
                },
            });
        }
        Ok(())
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        // Both fail only if the decoder has been waited for already.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Lets the decoder drop the frames that are not wanted, so that they never cross the pipe.
///
/// Every frame before them is decoded all the same: a seek lands on the wrong frame in many files.
fn frame_choice(spec: &SourceSpec) -> Vec<String> {
    let (start, step) = (spec.start, spec.step);
    let mut arguments = Vec::new();
    if start > 0 || step > 1 {
        let chosen = format!("select=gte(n\\,{start})*not(mod(n-{start}\\,{step}))");
        arguments.extend(["-vf".to_owned(), chosen]);
    }
    if let Some(count) = spec.count {
        arguments.extend(["-frames:v".to_owned(), count.to_string()]);
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decoder_drops_what_is_not_wanted() {
        let spec = SourceSpec {
            start: 5,
            step: 10,
            count: Some(4),
            ..SourceSpec::new("x")
        };
        assert_eq!(
            frame_choice(&spec),
            [
                "-vf",
                "select=gte(n\\,5)*not(mod(n-5\\,10))",
                "-frames:v",
                "4"
            ]
        );
        assert!(frame_choice(&SourceSpec::new("x")).is_empty());
    }
    /// A second of video, too large for the pipe; `None` without ffmpeg.
    #[cfg(target_os = "linux")]
    fn long_video(folder: &Path) -> Option<PathBuf> {
        let path = folder.join("long.nut");
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
            .args(["testsrc=size=640x480:duration=1", "-c:v", "rawvideo"])
            .arg(&path)
            .status();
        made.is_ok().then_some(path)
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn dropping_a_video_ends_its_decoder() {
        let folder = tempfile::tempdir().unwrap();
        let Some(path) = long_video(folder.path()) else {
            return;
        };
        let mut video = Video::open(&path, &SourceSpec::new("x")).unwrap();
        let decoder = PathBuf::from(format!("/proc/{}", video.child.id()));
        let mut rgb = vec![0; 640 * 480 * 3];
        assert!(video.read_into(&mut rgb).unwrap());
        assert!(decoder.exists());
        drop(video);
        assert!(!decoder.exists());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_decoder_that_nobody_listens_to_ends() {
        let folder = tempfile::tempdir().unwrap();
        let Some(path) = long_video(folder.path()) else {
            return;
        };
        let mut video = Video::open(&path, &SourceSpec::new("x")).unwrap();
        // What the death of this process would do: the only reader of the pipe goes away.
        let silent = Command::new("true").stdout(Stdio::piped()).spawn();
        let (mut silent, unheard) = (silent.unwrap(), &mut video.stdout);
        drop(std::mem::replace(unheard, silent.stdout.take().unwrap()));
        assert!(!video.child.wait().unwrap().success());
        silent.wait().unwrap();
    }
}
