//! The clock of an RTSP camera: the times of its sender reports, which `ffmpeg` writes beside the packets.
//!
//! An RTSP camera that knows the time sends RTCP sender reports from time to time (RFC 3550, 6.4.1). A report contains a time of the stream
//! and the same moment on the camera's own clock. `ffmpeg` does not give these times to programs or write them to its log, but it writes
//! them into fragmented MP4: a `prft` box before every fragment (ISO/IEC 14496-12, 8.16.5).
//!
//! Before the first report, or if a camera sends no reports, the box contains the time at which the packet was written. That time jitters,
//! whereas the camera's own time does not.

use std::io::{self, ErrorKind, PipeReader, PipeWriter, Read, pipe};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use rustix::io::{FdFlags, fcntl_setfd};

/// Number of consecutive offsets that must agree; the next constant is their tolerance in nanoseconds, because `ffmpeg` rounds to whole
/// milliseconds.
const N_EQUAL: usize = 16;
const EQUAL_NANOS: i64 = 1_100_000;
/// Seconds from 1900, where NTP begins, to 1970.
const NTP_TO_UNIX_S: i64 = 2_208_988_800;
/// Value that stands for an unknown offset.
const UNKNOWN: i64 = i64::MIN;
/// Maximum plausible length of a box, in bytes.
const MAX_HEAD: u64 = 1 << 20;
const MAX_TIME: u64 = 64;

/// Returns the `ffmpeg` options that write a camera's times and packets to a pipe. If the pipe cannot be written to, the pictures are
/// decoded nevertheless.
///
/// * `pipe`: address of the pipe, with `:` escaped.
pub(crate) fn times_of_sender(pipe: &str) -> Vec<String> {
    let fragments = "frag_every_frame+empty_moov+default_base_moof+delay_moov";
    let written = format!(
        "[onfail=ignore:f=mp4:avoid_negative_ts=disabled:movflags={fragments}:write_prft=wallclock]{pipe}|[f=null]-"
    );
    let all = ["-map", "0:v:0", "-c:v", "copy", "-f", "tee", &written];
    all.map(str::to_owned).into()
}

/// Creates a pipe. Child processes inherit the writing end until it is dropped.
pub(crate) fn inherited_pipe() -> io::Result<(PipeReader, PipeWriter)> {
    let (reader, writer) = pipe()?;
    fcntl_setfd(&writer, FdFlags::empty())?;
    Ok((reader, writer))
}

/// Clock of a camera, which becomes known while its stream is read.
#[derive(Debug, Clone)]
pub(crate) struct SenderClock(Arc<AtomicI64>);

impl SenderClock {
    /// Reads a fragmented MP4 stream to its end on a separate thread.
    pub(crate) fn follow(stream: impl Read + Send + 'static) -> io::Result<Self> {
        let clock = Self(Arc::new(AtomicI64::new(UNKNOWN)));
        let told = clock.clone();
        let thread = std::thread::Builder::new().name("clock of a camera".to_owned());
        thread.spawn(move || {
            let mut boxes = Boxes::new(stream);
            let mut offsets = Offsets::default();
            while let Ok(Some(time)) = boxes.next() {
                if let Some(offset) = offsets.add(time) {
                    told.0.store(offset, Ordering::Relaxed);
                }
            }
            // The remaining data is read and dropped, because the decoder would otherwise wait for the pipe.
            io::copy(&mut boxes.input, &mut io::sink()).ok();
        })?;
        Ok(clock)
    }

    /// Returns the camera's clock at time 0 of its stream, in nanoseconds since 1970; `None` if it is not known yet.
    pub(crate) fn offset_nanos(&self) -> Option<i64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|offset| *offset != UNKNOWN)
    }
}

/// A time of the stream, and the same moment on the clock, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Told {
    presented: i64,
    unix: i64,
}

/// Distinguishes times of a camera's clock from the times at which packets were written. A camera's times differ from the times of the
/// stream by a constant offset.
#[derive(Debug, Default)]
struct Offsets(Vec<i64>);

impl Offsets {
    /// Adds a time. Returns the mean of the last offsets once there are enough and they agree.
    fn add(&mut self, time: Told) -> Option<i64> {
        if self.0.len() == N_EQUAL {
            self.0.remove(0);
        }
        self.0.push(time.unix.checked_sub(time.presented)?);
        let least = *self.0.iter().min()?;
        let span = self.0.iter().max()?.saturating_sub(least);
        if self.0.len() < N_EQUAL || span > EQUAL_NANOS {
            return None;
        }
        let above: i64 = self.0.iter().map(|value| value - least).sum();
        Some(least + above / N_EQUAL as i64)
    }
}

struct Boxes<R> {
    input: R,
    /// Number of the stream's time units in a second; 0 before it is known.
    units_per_s: u32,
}

impl<R: Read> Boxes<R> {
    fn new(input: R) -> Self {
        Self {
            input,
            units_per_s: 0,
        }
    }

    /// Returns the next pair of times; `None` at the end of the stream.
    fn next(&mut self) -> io::Result<Option<Told>> {
        loop {
            let Some((kind, length)) = self.head()? else {
                return Ok(None);
            };
            match &kind {
                b"moov" => {
                    let head = self.body(length, MAX_HEAD)?;
                    self.units_per_s = units_per_s(&head).unwrap_or(0);
                }
                b"prft" => {
                    let told = told(&self.body(length, MAX_TIME)?, self.units_per_s);
                    if told.is_some() {
                        return Ok(told);
                    }
                }
                _ => {
                    let n = io::copy(&mut (&mut self.input).take(length), &mut io::sink())?;
                    if n != length {
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// Returns the kind of the next box and the length of its body; `None` at the end.
    fn head(&mut self) -> io::Result<Option<([u8; 4], u64)>> {
        let mut head = [0; 8];
        match self.input.read_exact(&mut head) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(None),
            read => read?,
        }
        let [a, b, c, d, kind @ ..] = head;
        let (length, n_read) = match u32::from_be_bytes([a, b, c, d]) {
            1 => {
                let mut long = [0; 8];
                self.input.read_exact(&mut long)?;
                (u64::from_be_bytes(long), 16)
            }
            short => (u64::from(short), 8),
        };
        // A length of 0 means "to the end of the file" and does not occur in a stream.
        let length = length.checked_sub(n_read).ok_or(ErrorKind::InvalidData)?;
        Ok(Some((kind, length)))
    }

    fn body(&mut self, length: u64, most: u64) -> io::Result<Vec<u8>> {
        if length > most {
            return Err(ErrorKind::InvalidData.into());
        }
        let mut body = vec![0; length as usize];
        self.input.read_exact(&mut body)?;
        Ok(body)
    }
}

/// Returns `N` bytes from an index.
fn bytes<const N: usize>(of: &[u8], at: usize) -> Option<[u8; N]> {
    of.get(at..)?.first_chunk().copied()
}

/// Returns the body of the first box of a kind among the consecutive boxes in `of`.
fn inside(mut of: &[u8], kind: [u8; 4]) -> Option<&[u8]> {
    loop {
        let length = u32::from_be_bytes(bytes(of, 0)?) as usize;
        let body = of.get(8..length)?;
        if bytes(of, 4)? == kind {
            return Some(body);
        }
        of = &of[length..];
    }
}

/// Returns the number of time units in a second, from the only track.
fn units_per_s(moov: &[u8]) -> Option<u32> {
    let media = inside(inside(moov, *b"trak")?, *b"mdia")?;
    let head = inside(media, *b"mdhd")?;
    let is_long = *head.first()? == 1;
    bytes(head, if is_long { 20 } else { 12 }).map(u32::from_be_bytes)
}

/// Reads a `prft` box.
fn told(body: &[u8], units_per_s: u32) -> Option<Told> {
    let is_long = *body.first()? == 1;
    let ntp = u64::from_be_bytes(bytes(body, 8)?);
    let units = if is_long {
        u64::from_be_bytes(bytes(body, 16)?).cast_signed()
    } else {
        i64::from(u32::from_be_bytes(bytes(body, 16)?))
    };
    let presented = (i128::from(units) * 1_000_000_000).checked_div(units_per_s.into())?;
    let seconds = (ntp >> 32).cast_signed() - NTP_TO_UNIX_S;
    let fraction = ((ntp & 0xffff_ffff) * 1_000_000_000) >> 32;
    Some(Told {
        presented: i64::try_from(presented).ok()?,
        unix: seconds * 1_000_000_000 + fraction.cast_signed(),
    })
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use proptest::prelude::*;

    use super::*;

    const MS: i64 = 1_000_000;

    fn boxed(kind: [u8; 4], body: &[u8]) -> Vec<u8> {
        let length = (body.len() + 8) as u32;
        [&length.to_be_bytes()[..], &kind, body].concat()
    }

    fn head() -> Vec<u8> {
        let media = [&[0; 12][..], &90_000_u32.to_be_bytes(), &[0; 8]].concat();
        let media = boxed(
            *b"mdia",
            &[boxed(*b"abcd", &[7]), boxed(*b"mdhd", &media)].concat(),
        );
        boxed(*b"moov", &boxed(*b"trak", &media))
    }

    /// Returns a `prft` box.
    ///
    /// * `ms`: milliseconds since 1970.
    fn time(units: u64, ms: u64) -> Vec<u8> {
        let seconds = (ms / 1000 + NTP_TO_UNIX_S as u64) << 32;
        let ntp = seconds | (((ms % 1000) << 32) / 1000);
        let body = [
            &[1, 0, 0, 24, 0, 0, 0, 1][..],
            &ntp.to_be_bytes(),
            &units.to_be_bytes(),
        ];
        boxed(*b"prft", &body.concat())
    }

    fn read(stream: &[u8]) -> Vec<Told> {
        let mut boxes = Boxes::new(stream);
        core::iter::from_fn(|| boxes.next().ok().flatten()).collect()
    }

    #[test]
    fn sender_times_are_read_between_the_packets() {
        let packet = boxed(*b"mdat", &[9; 500]);
        let stream = [head(), time(90_000, 5_250), packet, time(93_600, 5_290)].concat();
        let got = read(&stream);
        let expected = [(1_000, 5_250), (1_040, 5_290)];
        assert_eq!(got.len(), 2);
        for (got, (presented, unix)) in got.into_iter().zip(expected) {
            assert_eq!(got.presented, presented * MS);
            assert!((got.unix - unix * MS).abs() < 2, "{}", got.unix);
        }
        assert!(read(&time(1, 1)).is_empty(), "the unit is not known");
    }

    #[test]
    fn only_a_clock_with_a_constant_offset_is_accepted() {
        let mut offsets = Offsets::default();
        let told = |nth: i64, jitter: i64| Told {
            presented: nth * 40 * MS,
            unix: 7_000_000 * MS + nth * 40 * MS + jitter,
        };
        for nth in 0..200 {
            let jitter = nth * 7 % 5 * MS;
            assert_eq!(
                offsets.add(told(nth, jitter)),
                None,
                "of packets that arrive"
            );
        }
        let rounded = |nth: i64| nth % 3 * MS / 3;
        let found: Vec<Option<i64>> =
            (200..230).map(|nth| offsets.add(told(nth, rounded(nth)))).collect();
        assert_eq!(found[..N_EQUAL - 1], [None; N_EQUAL - 1]);
        let last = found[29].unwrap() - 7_000_000 * MS;
        assert!((last - MS / 3).abs() < MS / 10, "{last}");
    }

    /// Checks the output of the real program for packets that arrive all at the same time.
    #[expect(clippy::print_stderr, reason = "a skipped test must say so")]
    #[test]
    fn ffmpeg_gives_every_picture_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let clip = folder.path().join("clip.mp4");
        let made = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
            .args(["testsrc=size=64x48:rate=10:duration=3", "-c:v", "mpeg4"])
            .arg(&clip)
            .status();
        if made.is_err() {
            eprintln!("skipped: there is no ffmpeg on the PATH");
            return;
        }
        let written = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-i"])
            .arg(&clip)
            .args(times_of_sender("pipe\\:1"))
            .output()
            .unwrap();
        let told = read(&written.stdout);
        let steps = told.windows(2).map(|pair| pair[1].presented - pair[0].presented);
        assert_eq!(steps.collect::<Vec<_>>(), [100 * MS; 29]);
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let age_s = now.unwrap().as_secs_f64() - told[29].unix as f64 * 1e-9;
        assert!((0.0..600.0).contains(&age_s), "{age_s}");
    }

    proptest! {
        #[test]
        fn any_bytes_are_parsed_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut offsets = Offsets::default();
            for stream in [bytes.clone(), [head(), bytes.clone()].concat(), [head(), boxed(*b"prft", &bytes)].concat()] {
                for told in read(&stream) {
                    offsets.add(told);
                }
            }
            units_per_s(&bytes);
        }
    }
}
