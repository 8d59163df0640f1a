//! A video, decoded by an `ffmpeg` process and read from a pipe.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use super::log::Log;
use super::probe::{Probe, input_name, missing, probe};
use crate::{FootageError, SourceSpec};

/// A running decoder. It is killed when this is dropped. If this process dies without dropping it,
/// the decoder ends at its next write to the closed pipe.
#[derive(Debug)]
pub(super) struct Video {
    path: PathBuf,
    pub(super) probe: Probe,
    /// Expected frames, from the index of the container.
    pub(super) n_frames: u64,
    /// Expected frames, from the duration in the header.
    n_promised: u64,
    n_read: u64,
    /// Index in the footage of the frame that was read last.
    last_index: u64,
    /// Distance between the frames that are read, and the first of them.
    step: u64,
    start: u64,
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
            .args(outputs(&probe, spec))
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
            last_index: spec.start,
            step: spec.step,
            start: spec.start,
            child,
            stdout,
            log: Log::follow(stderr).map_err(not_started)?,
        })
    }

    /// Reads the next frame, and returns its index in the footage; `None` at the end of a complete video.
    ///
    /// The index of a frame that could not be decoded is left out.
    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> Result<Option<u64>, FootageError> {
        let mut filled = 0;
        while filled < rgb.len() {
            match self.stdout.read(&mut rgb[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(source) => {
                    return Err(FootageError::Io {
                        path: self.path.clone(),
                        source,
                    });
                }
            }
        }
        if filled == rgb.len() {
            self.last_index = self.index();
            self.n_read += 1;
            return Ok(Some(self.last_index));
        }
        self.check_end(filled > 0)?;
        Ok(None)
    }

    /// The index of the frame that has just been read: by its time where frames are equally spaced, else
    /// by counting.
    fn index(&self) -> u64 {
        let counted = match self.n_read {
            0 => self.start,
            _ => self.last_index.saturating_add(self.step),
        };
        let Some(rate_hz) = self.probe.regular_hz() else {
            return counted;
        };
        let by_time = self.log.next_time().map(|it| (it.time_s * rate_hz).round());
        by_time.map_or(counted, |index| counted.max(index as u64))
    }

    /// Distinguishes the end of a complete video from one that is cut off.
    ///
    /// A video counts as damaged if the decoder reports errors *and* frames are missing: many valid videos cause
    /// messages, and some containers count a frame or two that are never shown. Without a message, a tenth of
    /// the frames may be missing. The duration in the header is used only if there is a message, because the
    /// sound may be longer than the pictures.
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
        // Frames that could not be decoded do not mean that the end is missing.
        let n_reached = (self.last_index - self.start) / self.step + 1;
        let has_errors = !message.is_empty() && n_reached < n_expected;
        let is_short = n_reached < self.n_frames - self.n_frames / 10;
        if has_errors || is_partial || is_short || !status.success() {
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

/// The outputs of the decoder: the pixels of the chosen frames and, where frames are equally spaced, the time of
/// each on standard error. A frame that cannot be decoded is missing in both.
fn outputs(probe: &Probe, spec: &SourceSpec) -> Vec<String> {
    let pixels = ["-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"];
    let mut arguments = output(probe, spec, None, &pixels);
    if probe.regular_hz().is_some() {
        let times = ["-flush_packets", "1", "-f", "framecrc", "pipe:2"];
        arguments.extend(output(probe, spec, Some("crop=2:2:0:0:exact=1"), &times));
    }
    arguments
}

fn output(probe: &Probe, spec: &SourceSpec, more: Option<&str>, format: &[&str]) -> Vec<String> {
    let mut filters = frame_choice(probe, spec);
    filters.extend(more.map(str::to_owned));
    let mut arguments = vec!["-map".to_owned(), "0:v:0".to_owned()];
    if !filters.is_empty() {
        arguments.extend(["-vf".to_owned(), filters.join(",")]);
    }
    if let Some(count) = spec.count {
        arguments.extend(["-frames:v".to_owned(), count.to_string()]);
    }
    let mode = if probe.has_fps_mode {
        "-fps_mode"
    } else {
        "-vsync"
    };
    arguments.extend([mode, "passthrough"].map(str::to_owned));
    arguments.extend(format.iter().copied().map(str::to_owned));
    arguments
}

/// The filter that drops the frames that are not wanted before they are written to the pipe.
///
/// Every earlier frame is decoded nevertheless: a seek finds the wrong frame in many files. Where
/// frames are equally spaced they are chosen by their time, so that one which cannot be decoded does not
/// shift the others.
fn frame_choice(probe: &Probe, spec: &SourceSpec) -> Vec<String> {
    let (start, step) = (spec.start, spec.step);
    let is_part = start > 0 || step > 1;
    match probe.regular_hz() {
        None if is_part => vec![format!(
            "select=gte(n\\,{start})*not(mod(n-{start}\\,{step}))"
        )],
        None => Vec::new(),
        Some(rate_hz) => {
            let nth = format!("round(t*{rate_hz:?})");
            let chosen = format!("select=gte({nth}\\,{start})*not(mod({nth}-{start}\\,{step}))");
            let all = ["setpts=PTS-STARTPTS".to_owned(), chosen].into_iter();
            all.take(if is_part { 2 } else { 1 }).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe(times_s: Option<Vec<f64>>) -> Probe {
        Probe {
            size: crate::Size::new(4, 4),
            rate_hz: Some(12.5),
            n_frames: 100,
            n_promised: 100,
            times_s,
            has_fps_mode: true,
        }
    }

    #[test]
    fn the_decoder_drops_frames_that_are_not_wanted() {
        let spec = SourceSpec {
            start: 5,
            step: 10,
            count: Some(4),
            ..SourceSpec::new("x")
        };
        let by_number = "select=gte(n\\,5)*not(mod(n-5\\,10))";
        assert_eq!(frame_choice(&probe(Some(vec![])), &spec), [by_number]);
        let by_time = "select=gte(round(t*12.5)\\,5)*not(mod(round(t*12.5)-5\\,10))";
        assert_eq!(
            frame_choice(&probe(None), &spec),
            ["setpts=PTS-STARTPTS", by_time]
        );
        assert!(frame_choice(&probe(Some(vec![])), &SourceSpec::new("x")).is_empty());
        let arguments = outputs(&probe(None), &spec);
        let counts = arguments.windows(2).filter(|it| *it == ["-frames:v", "4"]);
        assert_eq!(counts.count(), 2, "pixels and times of the same frames");
        let counted = outputs(&probe(Some(vec![])), &spec);
        assert!(!counted.contains(&"framecrc".to_owned()), "{counted:?}");
    }

    /// A second of video, too large for the pipe; `None`, with a message, without ffmpeg.
    #[cfg(target_os = "linux")]
    #[expect(clippy::print_stderr, reason = "a skipped test must say so")]
    fn long_video(folder: &Path) -> Option<PathBuf> {
        let path = folder.join("long.nut");
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
            .args(["testsrc=size=640x480:duration=1", "-c:v", "rawvideo"])
            .arg(&path)
            .status();
        if made.is_err() {
            eprintln!("skipped: there is no ffmpeg on the PATH");
        }
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
        assert_eq!(video.read_into(&mut rgb).unwrap(), Some(0));
        assert!(decoder.exists());
        drop(video);
        assert!(!decoder.exists());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_decoder_ends_when_its_pipe_is_closed() {
        let folder = tempfile::tempdir().unwrap();
        let Some(path) = long_video(folder.path()) else {
            return;
        };
        let mut video = Video::open(&path, &SourceSpec::new("x")).unwrap();
        // As after the death of this process: the only reader of the pipe is closed.
        let other = Command::new("true").stdout(Stdio::piped()).spawn();
        let (mut other, pipe) = (other.unwrap(), &mut video.stdout);
        drop(std::mem::replace(pipe, other.stdout.take().unwrap()));
        assert!(!video.child.wait().unwrap().success());
        other.wait().unwrap();
    }
}
