//! A live stream from a network, decoded by an `ffmpeg` process.

use core::fmt;
use std::ffi::OsString;
use std::io::{self, ErrorKind, Read as _, pipe};
use std::os::fd::AsRawFd as _;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::Value;

use crate::http;
use crate::programs::{output_within, version_of};
use crate::sender::{SenderClock, inherited_pipe, times_of_sender};
use crate::source::LiveAddress;
use crate::source::log::{Log, summary};
use crate::source::password::without_password_of;
use crate::source::probe::{fraction, is_5_1};
use crate::source::program::{missing, shrink_filter};
use crate::{FootageError, Pieces, Size};

/// Time without data, in seconds, after which a stream is assumed to have ended.
const SILENCE_S: u64 = 5;
/// Maximum time until the size and rate of a stream are known. It is longer than any time limit of the decoder.
const PATIENCE: Duration = Duration::from_secs(20);
/// Minimum and maximum plausible rate in a header, in frames per second.
const RATES_HZ: [f64; 2] = [1.0, 1000.0];
/// Divisor of a picture's rows: the decoder reports the number of bytes of the top eighth of each picture, in grey.
pub(crate) const SHARE: usize = 8;
/// Options that write the original packets, with every picture as a separate cluster, to the pipe on standard input.
const AS_IT_CAME: [&str; 14] = [
    "-map",
    "0:v:0",
    "-c:v",
    "copy",
    "-f",
    "matroska",
    "-cluster_time_limit",
    "1",
    "-flush_packets",
    "1",
    "-avoid_negative_ts",
    "disabled",
    "-y",
    "pipe:0",
];

/// Transport of the packets of an RTSP camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// TCP: late packets delay the packets after them.
    Tcp,
    /// UDP: late packets are lost.
    Udp,
}

/// A stream to open.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamSpec {
    /// Address of the stream, `rtsp://...`.
    pub address: String,
    /// Transport of RTSP packets. If not set, server and decoder choose it.
    pub transport: Option<Transport>,
    /// The `ffmpeg` executable.
    pub ffmpeg: PathBuf,
    /// The `ffprobe` executable.
    pub ffprobe: PathBuf,
    /// True if the original packets are needed in addition to the pictures.
    pub keeps: bool,
    /// True if JPEG pictures over HTTP are sent without a boundary before the first one.
    pub is_bare: bool,
    /// Maximum factor by which the decoder may shrink the pictures, as in [`SourceSpec::most_shrink`](crate::SourceSpec::most_shrink).
    pub most_shrink: usize,
}

/// Properties of a stream, read from its first packets.
struct Asked {
    size: Size,
    rate_hz: Option<f64>,
    /// True if the camera's answer may be a single picture.
    may_be_picture: bool,
}

/// One frame of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamFrame {
    /// Presentation time of the frame on the clock of the camera, in nanoseconds after an arbitrary moment; `None` if the stream contains
    /// no times.
    pub presented_nanos: Option<i64>,
    /// Time at which the frame was taken, on the clock of the camera, in nanoseconds since 1970. `None` if the camera has not reported it;
    /// RTSP cameras report it some seconds after they are opened.
    pub unix_nanos: Option<i64>,
    /// Time of the frame in the decoder, in nanoseconds, even if the decoder has made it up. It is equal to
    /// [`Piece::nanos`](crate::Piece::nanos) within a millisecond.
    pub label_nanos: i64,
}

/// A running decoder of a stream. Dropping this value kills the decoder.
#[derive(Debug)]
pub struct LiveStream {
    address: String,
    shown: String,
    /// Size of the camera's pictures.
    size: Size,
    /// Size of the pictures that the decoder sends.
    sent_size: Size,
    has_times: bool,
    child: StreamEnd,
    stdout: ChildStdout,
    log: Log,
    clock: Option<SenderClock>,
    pieces: Option<Pieces>,
}

/// Ends a stream from a thread other than the one that waits for its frames.
#[derive(Debug, Clone)]
pub struct StreamEnd(pub(crate) Arc<Mutex<Child>>);

impl StreamEnd {
    /// Ends the decoder.
    pub fn end(&self) {
        let mut child = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Both calls fail only if the decoder has ended and its exit status has been read.
        child.kill().ok();
        child.wait().ok();
    }
}

impl StreamSpec {
    /// Returns a stream with the `ffmpeg` and `ffprobe` on the search path.
    pub fn new(address: impl Into<String>) -> Self {
        Self {
            address: address.into(),
            transport: None,
            ffmpeg: "ffmpeg".into(),
            ffprobe: "ffprobe".into(),
            keeps: false,
            is_bare: false,
            most_shrink: 1,
        }
    }

    /// Returns the size and rate of the stream, from its first packets. The rate is `None` if the stream does not state it.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::Stream`] if there is no answer or the answer is not a video, or [`FootageError::FfmpegMissing`].
    pub fn probe(&self) -> Result<(Size, Option<f64>), FootageError> {
        let answer = || http::ask(&self.address).map(http::Answer::complaint);
        let asked = match self.ask() {
            // Some cameras send no boundary before the first picture.
            Err(error) if self.is_http() && !self.is_bare => {
                let bare = Self {
                    is_bare: true,
                    ..self.clone()
                };
                bare.ask().map_err(|_no_pictures| match answer() {
                    Some(complaint) => self.failed(&complaint),
                    None => error,
                })
            }
            asked => asked,
        }?;
        let complaint = asked.may_be_picture.then(answer).flatten();
        complaint.map_or(Ok((asked.size, asked.rate_hz)), |complaint| {
            Err(self.failed(&complaint))
        })
    }

    fn ask(&self) -> Result<Asked, FootageError> {
        let entries = "stream=width,height,avg_frame_rate,r_frame_rate:format=format_name";
        let mut command = Command::new(&self.ffprobe);
        command
            .args(["-v", "error", "-select_streams", "v:0", "-of", "json"])
            .args(["-show_entries", entries])
            .args(self.input_options())
            .arg(&self.address)
            .process_group(0);
        let run = output_within(command, PATIENCE);
        let run = run.map_err(|source| missing(&self.ffprobe, self.shown().as_ref(), source))?;
        let Some(run) = run else {
            return Err(self.failed("nobody answers"));
        };
        if !run.status.success() {
            return Err(self.failed(&summary(&run.stderr)));
        }
        let found: Value = serde_json::from_slice(&run.stdout).unwrap_or_default();
        let stream = &found["streams"][0];
        let side = |key: &str| stream[key].as_u64().unwrap_or(0) as usize;
        let size = Size::new(side("width"), side("height"));
        if size.rgb_bytes() == 0 {
            return Err(self.failed("it has no video"));
        }
        let rates = ["r_frame_rate", "avg_frame_rate"].map(|name| fraction(&stream[name]));
        let is_usual = |value: &f64| (RATES_HZ[0]..=RATES_HZ[1]).contains(value);
        Ok(Asked {
            size,
            rate_hz: rates.into_iter().flatten().find(is_usual),
            may_be_picture: self.is_http() && found["format"]["format_name"] == "jpeg_pipe",
        })
    }

    /// Starts the decoder. A frame of another size than `size` ends the stream.
    ///
    /// * `size`: size of the camera's pictures, before they are shrunk.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::FfmpegMissing`]. If the address does not answer, the error occurs only when the first frame is read.
    pub fn open(&self, size: Size) -> Result<LiveStream, FootageError> {
        let not_started = |source| missing(&self.ffmpeg, self.shown().as_ref(), source);
        // A child process has three pipes. The third one is its standard input, to which it can write as to any other pipe.
        let (kept, to_keep) = if self.keeps {
            let (reader, writer) = pipe().map_err(not_started)?;
            (Some(reader), Some(writer))
        } else {
            (None, None)
        };
        let version = version_of(&self.ffmpeg);
        let shrink = size.divisor(self.most_shrink);
        let small = (shrink > 1).then(|| size.shrunk(shrink));
        let times = if self.is_rtsp() && is_5_1(&version) {
            Some(inherited_pipe().map_err(not_started)?)
        } else {
            None
        };
        let to_tell = times.as_ref().map(|time| format!("pipe\\:{}", time.1.as_raw_fd()));
        let mut child = Command::new(&self.ffmpeg)
            .args(["-nostdin", "-v", "error"])
            .args(self.input_options())
            .args(["-copyts", "-i"])
            .arg(&self.address)
            .args(outputs(&version, small))
            .args(to_keep.iter().flat_map(|_| AS_IT_CAME))
            .args(to_tell.iter().flat_map(|pipe| times_of_sender(pipe)))
            .stdin(to_keep.map_or_else(Stdio::null, Stdio::from))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // A signal from the terminal ends the run, which then ends the decoder.
            .process_group(0)
            .spawn()
            .map_err(not_started)?;
        let no_pipe = || not_started(ErrorKind::BrokenPipe.into());
        let stdout = child.stdout.take().ok_or_else(no_pipe)?;
        let stderr = child.stderr.take().ok_or_else(no_pipe)?;
        let pieces = kept.map(Pieces::follow).transpose().map_err(not_started)?;
        // The pipe is closed when the decoder ends, once this process has closed its own writing end.
        let clock = times.map(|(reader, _closed)| SenderClock::follow(reader));
        Ok(LiveStream {
            pieces,
            clock: clock.transpose().map_err(not_started)?,
            address: self.address.clone(),
            shown: self.shown(),
            size,
            sent_size: small.unwrap_or(size),
            has_times: self.has_times(),
            child: StreamEnd(Arc::new(Mutex::new(child))),
            stdout,
            log: Log::follow(stderr).map_err(not_started)?,
        })
    }

    /// Returns the address without a password.
    fn shown(&self) -> String {
        LiveAddress::Stream(self.address.clone()).to_string()
    }

    /// Returns the error for a message of the decoder, without the password that the message may repeat.
    fn failed(&self, message: &str) -> FootageError {
        failed(&self.shown(), &without_password_of(&self.address, message))
    }

    fn is(&self, scheme: &str) -> bool {
        let own = self.address.split(':').next().unwrap_or_default();
        own.eq_ignore_ascii_case(scheme)
    }

    fn is_rtsp(&self) -> bool {
        self.is("rtsp") || self.is("rtsps")
    }

    fn is_http(&self) -> bool {
        self.is("http") || self.is("https")
    }

    /// Returns true if the stream contains times of frames. For JPEG pictures over HTTP, the decoder makes up the times.
    fn has_times(&self) -> bool {
        !self.is_http()
    }

    fn input_options(&self) -> Vec<OsString> {
        let limit = (SILENCE_S * 1_000_000).to_string();
        let mut options = vec!["-fflags", "nobuffer", "-flags", "low_delay"];
        options.extend(["-analyzeduration", "1000000", "-probesize", "1000000"]);
        if !self.has_times() {
            // Drop truncated JPEG pictures, because their lower part would otherwise be grey.
            options.extend(["-err_detect", "explode"]);
        }
        if self.is_bare {
            options.extend(["-f", "mjpeg"]);
        }
        let is_rtsp = self.is_rtsp();
        let listens = self.address.contains("listen");
        if is_rtsp {
            options.extend(self.transport.map_or(&[][..], |transport| match transport {
                Transport::Tcp => &["-rtsp_transport", "tcp"],
                Transport::Udp => &["-rtsp_transport", "udp"],
            }));
        }
        let of_silence = if is_rtsp || self.is("udp") {
            "-timeout"
        } else {
            "-rw_timeout"
        };
        if !listens && !self.is("rtp") && !self.is("srt") {
            options.extend([of_silence, &limit]);
        }
        options.into_iter().map(OsString::from).collect()
    }
}

/// Returns the options that write the time and size of each frame to standard error, and then its pixels to standard output as for files.
///
/// * `version`: version of `ffmpeg`.
/// * `small`: size of the pixels, if they are shrunk.
pub(crate) fn outputs(version: &str, small: Option<Size>) -> Vec<String> {
    let mode = if is_5_1(version) {
        "-fps_mode"
    } else {
        "-vsync"
    };
    let common = ["-map", "0:v:0", mode, "passthrough", "-autoscale", "0"];
    // With more threads, the step that copies the pixels holds a picture back until the next picture arrives.
    let alone = ["-threads", "1"];
    let top = format!("crop=iw:trunc(ih/{SHARE}):0:0:exact=1,format=gray");
    let shrink = small.map(shrink_filter);
    let shrink: Vec<&str> =
        shrink.as_deref().into_iter().flat_map(|filter| ["-vf", filter]).collect();
    let pixels = ["-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"];
    let times = [
        "-vf",
        &top,
        "-enc_time_base",
        "1:1000000",
        "-flush_packets",
        "1",
    ];
    let all = [
        &common[..],
        &alone,
        &times,
        &["-f", "framecrc", "pipe:2"],
        &common,
        &alone,
        &shrink,
        &pixels,
    ];
    all.concat().into_iter().map(str::to_owned).collect()
}

/// Returns the error message for a stream that ends without a message from its decoder.
fn ended(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => "the stream has ended".to_owned(),
        _ => format!("the stream has ended ({error})"),
    }
}

fn failed(shown: &str, message: &str) -> FootageError {
    FootageError::Stream {
        address: shown.to_owned(),
        message: message.to_owned(),
    }
}

impl LiveStream {
    /// Waits for the next frame and reads it into `rgb`.
    ///
    /// # Errors
    ///
    /// Returns [`FootageError::Stream`] with the decoder's message if the stream has ended, or
    /// [`FootageError::SizeChanged`] if its size has changed.
    ///
    /// # Panics
    ///
    /// Panics if the length of `rgb` does not match the size with which the stream was opened, after shrinking.
    pub fn next_into(&mut self, rgb: &mut [u8]) -> Result<StreamFrame, FootageError> {
        assert_eq!(
            rgb.len(),
            self.sent_size.rgb_bytes(),
            "a frame is {} in RGB",
            self.sent_size
        );
        if let Err(error) = self.stdout.read_exact(rgb) {
            self.child.end();
            let said = self.log.finish();
            let message = if said.is_empty() {
                ended(&error)
            } else {
                without_password_of(&self.address, &said)
            };
            return Err(failed(&self.shown, &message));
        }
        let Some(time) = self.log.next_time() else {
            return Err(failed(&self.shown, "the decoder gives no times"));
        };
        let rows = self.size.height / SHARE;
        if time.bytes != (self.size.width * rows) as u64 {
            return Err(FootageError::SizeChanged {
                path: self.shown.clone().into(),
                expected: self.size,
            });
        }
        // A time that is not a number becomes 0.
        let nanos = (time.time_s * 1e9).round() as i64;
        let presented = (self.has_times && time.time_s.is_finite()).then_some(nanos);
        let offset = self.clock.as_ref().and_then(SenderClock::offset_nanos);
        Ok(StreamFrame {
            label_nanos: nanos,
            presented_nanos: presented,
            unix_nanos: presented.zip(offset).map(|times| times.0.saturating_add(times.1)),
        })
    }

    /// Returns the pieces of the original stream, if they were requested.
    pub fn pieces(&self) -> Option<&Pieces> {
        self.pieces.as_ref()
    }

    /// Returns a handle that ends this stream from another thread.
    pub fn end(&self) -> StreamEnd {
        self.child.clone()
    }
}

impl Drop for LiveStream {
    fn drop(&mut self) {
        self.child.end();
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tcp => "tcp",
            Self::Udp => "udp",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_never_contain_a_password() {
        let spec = StreamSpec::new("rtsp://me:secret@127.0.0.1:9/a");
        let said = spec.failed("rtsp://me:secret@127.0.0.1:9/a: Connection refused").to_string();
        assert!(!said.contains("secret"), "{said}");
        assert!(said.contains("Connection refused"), "{said}");
    }

    #[test]
    fn a_program_that_does_not_end_is_killed() {
        let mut command = Command::new("sleep");
        command.arg("1000");
        assert!(output_within(command, Duration::from_millis(50)).unwrap().is_none());
        let mut command = Command::new("echo");
        command.arg("here");
        let ended = output_within(command, PATIENCE).unwrap().unwrap();
        assert!(ended.status.success() && ended.stdout == b"here\n");
    }

    #[test]
    fn decoder_options_depend_on_the_kind_of_stream() {
        let options = |address: &str| {
            let spec = StreamSpec {
                transport: Some(Transport::Tcp),
                ..StreamSpec::new(address)
            };
            let all = spec.input_options();
            all.into_iter()
                .filter_map(|argument| argument.into_string().ok())
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert!(options("rtsp://a/b").contains("-rtsp_transport tcp -timeout 5000000"));
        assert!(options("http://a/b").contains("-rw_timeout 5000000"));
        assert!(
            options("http://a/b").contains("explode") && !options("udp://a").contains("explode")
        );
        assert!(!options("udp://:5000").contains("rtsp"));
        assert!(
            !StreamSpec::new("http://a/b").has_times() && StreamSpec::new("rtsp://a").has_times()
        );
    }
}
