//! A video, decoded by an `ffmpeg` process and read from a pipe.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use super::log::{Complaints, Log};
use super::planes::Standard;
use super::probe::{Probe, key_frames, probe};
use super::program::{input_name, input_options, missing, shrink_filter};
use crate::{FootageError, Size, SourceSpec};

/// A running decoder. Dropping this value kills the decoder. If this process dies without dropping it,
/// the decoder ends at its next write to the closed pipe.
#[derive(Debug)]
pub(super) struct Video {
    path: PathBuf,
    pub(super) probe: Probe,
    /// Size of the pictures after rotation and shrinking.
    pub(super) size: Size,
    /// Factor by which the pictures are shrunk.
    pub(super) shrink: usize,
    spec: SourceSpec,
    /// Expected number of frames, from the index of the container.
    pub(super) n_frames: u64,
    /// Expected number of frames, from the duration in the header.
    n_promised: u64,
    n_read: u64,
    /// Number of returned frames.
    n_given: u64,
    /// Index in the footage of the last frame that was read.
    last_index: u64,
    /// Last frame for which the decoder has reported a time.
    last_told: Option<u64>,
    /// Number of pictures that the decoder had left out when the last gap was found.
    n_undecoded: u64,
    /// Key frames, which can be decoded independently of others. Set while the frames that are read depend on a frame that could not be
    /// decoded.
    is_broken: Option<Vec<u64>>,
    child: Child,
    stdout: ChildStdout,
    log: Log,
    /// Memory for a picture that the decoder sends as planes.
    planes: Vec<u8>,
}

impl Video {
    pub(super) fn open(path: &Path, spec: &SourceSpec) -> Result<Self, FootageError> {
        let probe = probe(path, spec)?;
        let n_frames = spec.n_delivered(probe.n_frames)?;
        let n_promised = spec.n_delivered(probe.n_promised)?;
        let not_started = |source| missing(&spec.ffmpeg, path, source);
        let mut child = Command::new(&spec.ffmpeg)
            // Incomplete pictures are left out, because the decoder would otherwise make up the missing parts.
            .args(["-nostdin", "-v", "error", "-noautorotate"])
            .args(["-err_detect:v", "explode"])
            .args(threads(spec))
            .args(input_options(path))
            .arg("-i")
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
            size: turned_size(&probe, spec).shrunk(shrink(&probe, spec)),
            shrink: shrink(&probe, spec),
            probe,
            spec: spec.clone(),
            n_frames,
            n_promised,
            n_read: 0,
            n_given: 0,
            last_index: spec.start,
            last_told: None,
            n_undecoded: 0,
            is_broken: None,
            child,
            stdout,
            log: Log::follow(stderr).map_err(not_started)?,
            planes: Vec::new(),
        })
    }

    /// Reads the next frame. Returns its index in the footage; `None` at the end of a complete video.
    ///
    /// Indices of frames that could not be decoded are skipped.
    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> Result<Option<u64>, FootageError> {
        while self.spec.count.is_none_or(|most| self.n_given < most) {
            if !self.fill(rgb)? {
                return Ok(None);
            }
            let is_whole = self.identify()?;
            self.n_read += 1;
            if is_whole && self.is_chosen(self.last_index) {
                self.n_given += 1;
                return Ok(Some(self.last_index));
            }
        }
        Ok(None)
    }

    /// Finds the index of the frame whose pixels have just been read. Returns true if the frame was decoded completely.
    fn identify(&mut self) -> Result<bool, FootageError> {
        let due = match self.n_read {
            0 => self.spec.start,
            _ => self.last_index.saturating_add(self.spec.step),
        };
        if !has_times(&self.probe) {
            self.last_index = due;
            return Ok(true);
        }
        loop {
            // The decoder reports the times of all frames, but the pixels only of the selected frames.
            let time_s = self.log.next_time().map(|next_time| next_time.time_s);
            let Some(told) = time_s.and_then(|time_s| self.probe.frame_at(time_s)) else {
                self.last_index = due;
                return Ok(true);
            };
            let first = if self.is_listed() { 0 } else { self.spec.start };
            let next = self.last_told.map_or(first, |last_told| last_told + 1);
            let is_whole = self.is_whole(told.max(next), next)?;
            self.last_told = Some(told.max(next));
            if self.is_listed() || self.is_chosen(told) {
                self.last_index = told.max(if self.is_listed() { next } else { due });
                return Ok(is_whole);
            }
        }
    }

    fn is_chosen(&self, index: u64) -> bool {
        let SourceSpec { start, step, .. } = self.spec;
        index >= start && (index - start).is_multiple_of(step)
    }

    fn is_listed(&self) -> bool {
        self.probe.listed_s().is_some()
    }

    /// Returns the error messages of the decoder so far.
    pub(super) fn complaints(&self) -> Complaints {
        self.log.complaints()
    }

    /// Reads the pixels of the next frame of the decoder. Returns true if there was a frame.
    fn fill(&mut self, rgb: &mut [u8]) -> Result<bool, FootageError> {
        let Some(standard) = planes(&self.probe, &self.spec) else {
            return self.fill_with_bytes(rgb);
        };
        let mut planes = core::mem::take(&mut self.planes);
        planes.resize(rgb.len(), 0);
        let is_there = self.fill_with_bytes(&mut planes);
        standard.to_rgb(&planes, rgb);
        self.planes = planes;
        is_there
    }

    /// Reads the bytes of the next frame of the decoder. Returns true if there was a frame.
    fn fill_with_bytes(&mut self, rgb: &mut [u8]) -> Result<bool, FootageError> {
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
        if filled < rgb.len() {
            self.check_end(filled > 0)?;
        }
        Ok(filled == rgb.len())
    }

    /// Returns true if a frame does not depend on a frame that failed to decode. After a failure, this is the case from the next key frame
    /// on.
    ///
    /// * `next`: the expected index, which follows the index of the previous frame.
    fn is_whole(&mut self, index: u64, next: u64) -> Result<bool, FootageError> {
        if !self.probe.is_inter {
            return Ok(true);
        }
        if index > next && self.is_broken.is_none() {
            let n_undecoded = self.log.complaints().undecoded;
            if core::mem::replace(&mut self.n_undecoded, n_undecoded) < n_undecoded {
                self.is_broken = Some(key_frames(&self.path, &self.spec, &self.probe)?);
            }
        }
        let Some(keys) = &self.is_broken else {
            return Ok(true);
        };
        let is_whole = keys.contains(&index);
        if is_whole {
            self.is_broken = None;
        }
        Ok(is_whole)
    }

    /// Distinguishes the end of a complete video from the end of a video that is cut off.
    ///
    /// A video counts as damaged if the decoder reports errors *and* frames are missing. Many valid videos cause messages, and some
    /// containers count a frame or two that are never shown. Without an error message, up to a tenth of the frames may be missing. The
    /// duration in the header is used only if there is an error message, because the sound may be longer than the pictures.
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
        // Even if some frames could not be decoded, the end of the video may be complete.
        let start = self.spec.start;
        let n_reached = (self.last_index.max(start) - start) / self.spec.step + 1;
        let has_errors = !message.is_empty() && n_reached < n_expected;
        let is_short = n_reached < self.n_frames - self.n_frames / 10;
        if has_errors || is_partial || is_short || !status.success() {
            return Err(FootageError::VideoTruncated {
                path: self.path.clone(),
                n_read: self.n_read,
                n_expected,
                message: if message.is_empty() {
                    format!("the decoder gave no message ({status})")
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
        // Both calls fail only if the decoder's exit status has already been read.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Returns the size of the pictures after rotation.
fn turned_size(probe: &Probe, spec: &SourceSpec) -> Size {
    spec.rotation.turn(probe.tag).size(probe.stored)
}

/// Returns the factor by which the pictures are shrunk.
fn shrink(probe: &Probe, spec: &SourceSpec) -> usize {
    probe.stored.divisor(spec.most_shrink)
}

/// Returns the standard of pictures that the decoder sends as planes. It does this for pictures that are shrunk but not rotated.
fn planes(probe: &Probe, spec: &SourceSpec) -> Option<Standard> {
    let is_shrunk = shrink(probe, spec) > 1;
    let is_level = spec.rotation.turn(probe.tag).filters().is_none();
    probe.standard.filter(|_| is_shrunk && is_level)
}

/// Returns true if the decoder can report the times of frames.
fn has_times(probe: &Probe) -> bool {
    probe.regular_hz().is_some() || probe.listed_s().is_some()
}

/// Returns the option that limits the threads of the decoder.
fn threads(spec: &SourceSpec) -> Vec<String> {
    let of_decoder = |n: usize| ["-threads".to_owned(), n.to_string()].to_vec();
    spec.threads.map(of_decoder).unwrap_or_default()
}

/// Returns the options for the outputs of the decoder.
///
/// If frames can be identified by their times, the times of all frames are written to standard error. The pixels of the selected frames are
/// written to standard output. A frame that cannot be decoded is missing from both outputs.
///
/// Times are the first output. If two frames are decoded at once, the decoder first writes everything that belongs to its first output, and
/// then everything that belongs to its second. After reading the pixels of a frame, a reader must therefore wait for the frame's time
/// before it reads the next pixels.
fn outputs(probe: &Probe, spec: &SourceSpec) -> Vec<String> {
    let mut arguments = Vec::new();
    if has_times(probe) {
        let times = [
            "-enc_time_base",
            "1:1000000",
            "-flush_packets",
            "1",
            "-f",
            "framecrc",
            "pipe:2",
        ];
        // The times of all frames from the first to the last are written, so that a missing frame between the selected ones is noticed.
        let all = SourceSpec {
            step: 1,
            count: spec.count.map(|count| (count - 1).saturating_mul(spec.step).saturating_add(1)),
            ..spec.clone()
        };
        let small = "crop=2:2:0:0:exact=1".to_owned();
        arguments.extend(output(probe, &all, [small], &times));
    }
    let format = planes(probe, spec).map_or("rgb24", |_| "yuv444p");
    let pixels = ["-f", "rawvideo", "-pix_fmt", format, "pipe:1"];
    let turn = spec.rotation.turn(probe.tag).filters();
    let by = shrink(probe, spec);
    let small = (by > 1).then(|| shrink_filter(probe.stored.shrunk(by)));
    let filters = small.into_iter().chain(turn);
    arguments.extend(output(probe, spec, filters, &pixels));
    arguments
}

fn output(
    probe: &Probe,
    spec: &SourceSpec,
    more: impl IntoIterator<Item = String>,
    format: &[&str],
) -> Vec<String> {
    let mut filters = frame_choice(probe, spec);
    filters.extend(more);
    let mut arguments = vec!["-map".to_owned(), format!("0:{}", probe.stream)];
    if !filters.is_empty() {
        arguments.extend(["-vf".to_owned(), filters.join(",")]);
    }
    if let Some(count) = spec.count.filter(|_| probe.listed_s().is_none()) {
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

/// Returns the filter that drops unwanted frames before they are written to the pipe.
///
/// All earlier frames are decoded nevertheless, because a seek finds the wrong frame in many files. If frames are equally spaced, they are
/// selected by their times, so that a frame that cannot be decoded does not shift the others. If their times are listed, the reader of the
/// pipe selects them.
fn frame_choice(probe: &Probe, spec: &SourceSpec) -> Vec<String> {
    let (start, step) = (spec.start, spec.step);
    let is_part = start > 0 || step > 1;
    let from_first = probe.origin_s.map_or_else(
        || "setpts=PTS-STARTPTS".to_owned(),
        |origin_s| format!("setpts=PTS-({origin_s:?}/TB)"),
    );
    match probe.regular_hz() {
        None if probe.listed_s().is_some() => vec![from_first],
        None if is_part => vec![format!(
            "select=gte(n\\,{start})*not(mod(n-{start}\\,{step}))"
        )],
        None => Vec::new(),
        Some(rate_hz) => {
            let nth = format!("round(t*{rate_hz:?})");
            let chosen = format!("select=gte({nth}\\,{start})*not(mod({nth}-{start}\\,{step}))");
            let all = [from_first, chosen].into_iter();
            all.take(if is_part { 2 } else { 1 }).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Turn;

    fn probe(times_s: Option<Vec<f64>>) -> Probe {
        Probe {
            stream: 1,
            stored: Size::new(4, 4),
            tag: Turn::default(),
            rate_hz: Some(12.5),
            clock_hz: Some(12.5),
            n_frames: 100,
            n_promised: 100,
            times_s,
            uneven_s: None,
            origin_s: None,
            is_inter: false,
            is_interlaced: false,
            has_fps_mode: true,
            standard: None,
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
        let counts = arguments.windows(2).filter(|pair| pair[0] == "-frames:v");
        let counts: Vec<&str> = counts.map(|count| count[1].as_str()).collect();
        assert_eq!(
            counts,
            ["31", "4"],
            "times of all, pixels of the chosen frames"
        );
        assert!(
            comes_before(&arguments, "framecrc", "rawvideo"),
            "a time that comes after the pixels of the next frame is waited for in vain"
        );
        let counted = outputs(&probe(Some(vec![])), &spec);
        assert!(!counted.contains(&"framecrc".to_owned()), "{counted:?}");
    }

    fn comes_before(arguments: &[String], first: &str, second: &str) -> bool {
        let place = |word: &str| arguments.iter().position(|argument| argument == word);
        place(first).is_some() && place(first) < place(second)
    }

    #[test]
    fn stream_options_write_the_times_before_the_pixels() {
        assert!(comes_before(
            &crate::stream::outputs("5.1", None),
            "framecrc",
            "rawvideo"
        ));
    }

    /// Creates one second of video that does not fit into the pipe. Without ffmpeg, prints a message and returns `None`.
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
        // Closes the only reading end of the pipe, as the death of this process would do.
        let other = Command::new("true").stdout(Stdio::piped()).spawn();
        let (mut other, pipe) = (other.unwrap(), &mut video.stdout);
        drop(std::mem::replace(pipe, other.stdout.take().unwrap()));
        assert!(!video.child.wait().unwrap().success());
        other.wait().unwrap();
    }
}
