//! The standard error output of a decoder: error messages, and the time of every frame.

use std::io::Read;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Maximum number of bytes of a log that are kept; otherwise, a damaged video could fill a disk with its log.
const MAX_BYTES: usize = 16 << 10;
/// Capacity of the queue of times. It must have room for the times of all frames between two frames that are read, and for those of the
/// frames by which the decoder is ahead.
const MAX_TIMES: usize = 1 << 14;
/// Maximum time to wait for the time stamp of a frame whose pixels have been read.
const PATIENCE: Duration = Duration::from_secs(1);

/// Error messages of a decoder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Complaints {
    /// Number of messages.
    pub messages: u64,
    /// Number of messages saying that a picture could not be decoded.
    pub undecoded: u64,
    /// The last message.
    pub last: String,
}

/// How the messages begin or end, in different versions of `ffmpeg`, that report a picture left out.
const UNDECODED: [&str; 4] = [
    "Error while decoding stream",
    "Error submitting packet",
    "Error processing packet",
    "Decoding error",
];

/// Reads a log to its end on a separate thread, so that a decoder that writes many messages does not block.
#[derive(Debug)]
pub(crate) struct Log {
    reader: Option<JoinHandle<Vec<u8>>>,
    times: Receiver<FrameTime>,
    complaints: Arc<Mutex<Complaints>>,
}

/// Log entry of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameTime {
    /// Presentation time of the frame, in seconds.
    pub(crate) time_s: f64,
    /// Size of the frame in the format of this output, in bytes.
    pub(crate) bytes: u64,
}

impl Log {
    pub(crate) fn follow(stream: impl Read + Send + 'static) -> std::io::Result<Self> {
        let (sender, times) = sync_channel(MAX_TIMES);
        let lines = Lines::new(sender);
        let complaints = Arc::clone(&lines.complaints);
        let reader = std::thread::Builder::new()
            .name("decoder log".to_owned())
            .spawn(move || lines.read(stream))?;
        Ok(Self {
            reader: Some(reader),
            times,
            complaints,
        })
    }

    /// Returns the error messages of the decoder so far.
    pub(crate) fn complaints(&self) -> Complaints {
        let complaints = self.complaints.lock();
        complaints.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Returns the time of the next frame, after waiting for a short time if necessary.
    pub(crate) fn next_time(&self) -> Option<FrameTime> {
        self.times.recv_timeout(PATIENCE).ok()
    }

    /// Waits for the end of the log. Returns its last messages; empty if there were none.
    pub(crate) fn finish(&mut self) -> String {
        let bytes = self.reader.take().and_then(|thread| thread.join().ok());
        summary(&bytes.unwrap_or_default())
    }
}

/// Separates the lines of ffmpeg's `framecrc` output from error messages.
struct Lines {
    times: SyncSender<FrameTime>,
    /// Unit of time, in seconds, from the log's header.
    unit_s: f64,
    /// The error messages.
    kept: Vec<u8>,
    /// The beginning of an incomplete line.
    partial: Vec<u8>,
    complaints: Arc<Mutex<Complaints>>,
}

impl Lines {
    fn new(times: SyncSender<FrameTime>) -> Self {
        Self {
            times,
            unit_s: f64::NAN,
            kept: Vec::new(),
            partial: Vec::new(),
            complaints: Arc::default(),
        }
    }

    fn read(mut self, mut stream: impl Read) -> Vec<u8> {
        let mut chunk = [0; 1024];
        while let Ok(n @ 1..) = stream.read(&mut chunk) {
            for piece in chunk[..n].split_inclusive(|byte| *byte == b'\n') {
                self.partial.extend_from_slice(piece);
                if piece.ends_with(b"\n") || self.partial.len() > MAX_BYTES / 2 {
                    self.line();
                }
            }
        }
        self.line();
        self.kept
    }

    fn line(&mut self) {
        let line = std::mem::take(&mut self.partial);
        let text = String::from_utf8_lossy(&line);
        if let Some(unit_s) = text.strip_prefix("#tb 0: ") {
            self.unit_s = fraction(unit_s).unwrap_or(f64::NAN);
        } else if let Some((units, bytes)) = frame_units(&text) {
            let time_s = units * self.unit_s;
            // Times are dropped if the receiver is gone or too slow.
            self.times.try_send(FrameTime { time_s, bytes }).ok();
        } else if !text.starts_with('#') {
            self.complain(without_address(text.trim()));
            self.kept.extend_from_slice(&line);
            if self.kept.len() > MAX_BYTES {
                self.kept.drain(..self.kept.len() - MAX_BYTES / 2);
            }
        }
    }
}

impl Lines {
    fn complain(&self, message: &str) {
        if message.is_empty() {
            return;
        }
        let complaints = self.complaints.lock();
        let mut complaints = complaints.unwrap_or_else(PoisonError::into_inner);
        complaints.messages += 1;
        complaints.undecoded += u64::from(UNDECODED.iter().any(|words| message.contains(words)));
        message.clone_into(&mut complaints.last);
    }
}

/// Returns the time of a frame in a line such as `0,  0,  3,  1,  12, 0x14a00440`: stream, decoding time,
/// presentation time, duration, bytes, checksum.
///
/// The line is written in one step, but it may interrupt an error message, which is written in several steps. Any text before it is
/// therefore ignored.
fn frame_units(line: &str) -> Option<(f64, u64)> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let [.., stream, _, presented, _, bytes, checksum] = fields[..] else {
        return None;
    };
    let is_frame = stream.ends_with('0') && checksum.starts_with("0x");
    let bytes = bytes.parse().ok().filter(|_| is_frame)?;
    Some((presented.parse::<i64>().ok()? as f64, bytes))
}

/// Parses a fraction such as `1/25`.
fn fraction(text: &str) -> Option<f64> {
    let (above, below) = text.trim().split_once('/')?;
    let [above, below] = [above, below].map(|number| number.parse::<f64>().ok());
    Some(above? / below?)
}

/// Joins the last three lines into one.
pub(crate) fn summary(log: &[u8]) -> String {
    let text = String::from_utf8_lossy(log);
    let lines: Vec<&str> = text
        .lines()
        .map(|line| without_address(line.trim()))
        .filter(|line| !line.is_empty())
        .collect();
    lines[lines.len().saturating_sub(3)..].join("; ")
}

/// Removes the name of ffmpeg's component and its memory address, such as `[mov,mp4 @ 0x55d1]`, from a line.
fn without_address(line: &str) -> &str {
    let Some((head, rest)) = line.split_once("] ") else {
        return line;
    };
    let is_component = head.starts_with('[') && head.contains(" @ 0x");
    if is_component { rest } else { line }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the messages and the times in a text.
    fn read(text: &str) -> (Vec<u8>, Vec<f64>) {
        let (sender, times) = sync_channel(MAX_TIMES);
        let kept = Lines::new(sender).read(text.as_bytes());
        (kept, times.try_iter().map(|time| time.time_s).collect())
    }

    #[test]
    fn the_last_three_lines_are_kept_of_a_log_of_any_length() {
        let text = (0..100_000).fold(String::new(), |text, it| text + &format!("line {it}\n"));
        let (kept, times_s) = read(&text);
        assert!(kept.len() <= MAX_BYTES && times_s.is_empty());
        assert_eq!(summary(&kept), "line 99997; line 99998; line 99999");
        assert!(
            read(&"x".repeat(1 << 20)).0.len() <= MAX_BYTES,
            "without a line's end"
        );
    }

    #[test]
    fn times_of_frames_are_separated_from_messages() {
        let text = "#software: Lavf59\n#tb 0: 1/50\n#dimensions 0: 2x2\n0,   0,   0,   1,  12, 0x14a00440\n\
                    [h264 @ 0x5] error while decoding MB 3 14, bytestream -16\n\
                    [h264 @ 0x5] 0,   7,   7,   1,  12, 0x14a00440\ncabac error\n1, 2, 3, 4, 5, 6\n0, 9, x, 1, 12, 0x0";
        let (kept, times_s) = read(text);
        assert_eq!(times_s, [0.0, 0.14]);
        let expected = "[h264 @ 0x5] error while decoding MB 3 14, bytestream -16\n\
                    cabac error\n1, 2, 3, 4, 5, 6\n0, 9, x, 1, 12, 0x0";
        assert_eq!(String::from_utf8_lossy(&kept), expected);
    }

    #[test]
    fn an_empty_log_has_an_empty_summary() {
        assert_eq!(summary(b"\n  \n"), "");
    }

    #[test]
    fn memory_addresses_are_removed() {
        let log = b"[mov,mp4,m4a @ 0x56362d165d40] moov atom not found\n[a] b\n";
        assert_eq!(summary(log), "moov atom not found; [a] b");
    }
}
