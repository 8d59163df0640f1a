//! Properties of a video, from `ffprobe`.

use std::path::Path;

use serde_json::Value;

use super::answers::run_ffprobe;
use super::planes::Standard;
use crate::{FootageError, Size, SourceSpec, Turn};

/// Properties of a video that are known before it is decoded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Probe {
    /// Number of the stream in the file.
    pub(super) stream: u64,
    /// Size of the stored pictures.
    pub(super) stored: Size,
    /// Rotation given by the display matrix.
    pub(super) tag: Turn,
    /// Frames per second, if the file states them.
    pub(super) rate_hz: Option<f64>,
    /// Frames per second according to the times of the decoder, even if the decoder has made them up.
    pub(super) clock_hz: Option<f64>,
    /// Number of frames in the stream, from the container or by counting packets.
    pub(super) n_frames: u64,
    /// Number of frames according to the duration in the header.
    pub(super) n_promised: u64,
    /// Presentation times, in seconds after the first frame, if frames are not equally spaced.
    pub(super) times_s: Option<Vec<f64>>,
    /// Largest difference of a frame's time from equally spaced times, in seconds; `None` if it is below [`UNEVEN`].
    pub(super) uneven_s: Option<f64>,
    /// Time of the first frame in the decoder, in seconds; `None` if it is known only after the first frame has been decoded.
    pub(super) origin_s: Option<f64>,
    /// True if pictures can depend on other pictures.
    pub(super) is_inter: bool,
    /// True if the video is interlaced: the lines of every picture alternate between two different moments.
    pub(super) is_interlaced: bool,
    /// True if the `ffmpeg` option that keeps every frame is called `-fps_mode` (since version 5.1), false if it is called `-vsync`.
    pub(super) has_fps_mode: bool,
    /// Standard of the colours, if shrunk pictures can be sent as planes.
    pub(super) standard: Option<Standard>,
}

const ENTRIES: &str = "program_version=version:\
    stream=index,codec_name,width,height,nb_frames,avg_frame_rate,r_frame_rate,duration,start_time,has_b_frames,field_order,\
    pix_fmt,color_space,color_range:\
    stream_disposition=attached_pic,timed_thumbnails,still_image:stream_side_data:format=format_name,duration,start_time";
/// An unusual frame rate. It is passed to ffprobe to see whether ffprobe only repeats it, for a stream without a container.
const ODD_RATE: &str = "225/32";
/// Codecs whose pictures can be decoded independently of each other. The first four are also used for cover pictures.
const INTRA: [&str; 9] = [
    "mjpeg", "png", "bmp", "gif", "rawvideo", "ffv1", "huffyuv", "prores", "dnxhd",
];

/// Smallest difference of a frame's time from equally spaced times that is reported, as a fraction of the interval. One dropped frame causes
/// half an interval.
const UNEVEN: f64 = 0.4;

/// Probes the video stream of `path`.
///
/// Reads the whole file (without decoding) only in two cases: the container does not state the number of shown frames, or the frames
/// may not be equally spaced.
pub(super) fn probe(path: &Path, spec: &SourceSpec) -> Result<Probe, FootageError> {
    let wanted = ["-show_program_version", "-show_entries", ENTRIES];
    let output = run_ffprobe(path, spec, "v", &wanted)?;
    let stream = film(&output);
    let has_clock = |value: &Value| number(&value["start_time"]).is_some();
    let is_bare = number(&output["format"]["duration"]).is_none() && !has_clock(stream);
    let mut is_made_up = false;
    if is_bare {
        // A stream without a container may state its frame rate. If it does not, ffprobe assumes 25 Hz.
        let again = ["-framerate", ODD_RATE, "-show_entries", ENTRIES];
        let told = run_ffprobe(path, spec, "v", &again)?;
        is_made_up =
            film(&told)["avg_frame_rate"] == ODD_RATE || film(&told)["r_frame_rate"] == ODD_RATE;
    }
    let side = |key: &str| stream[key].as_u64().unwrap_or(0) as usize;
    let stored = Size::new(side("width"), side("height"));
    if stored.rgb_bytes() == 0 {
        return Err(FootageError::Video {
            path: path.to_path_buf(),
            message: "it has no video stream".to_owned(),
        });
    }
    let clock_hz = fraction(&stream["avg_frame_rate"]);
    let codec = stream["codec_name"].as_str().unwrap_or_default();
    let mut probe = Probe {
        stream: stream["index"].as_u64().unwrap_or(0),
        stored,
        tag: tag(stream),
        rate_hz: clock_hz.filter(|_| !is_made_up),
        clock_hz,
        n_frames: number(&stream["nb_frames"]).map_or(0, |value| value as u64),
        n_promised: 0,
        times_s: None,
        uneven_s: None,
        origin_s: origin(stream, &output["format"], codec),
        is_inter: !INTRA.contains(&codec),
        is_interlaced: ["tt", "bb", "tb", "bt"].iter().any(|name| stream["field_order"] == *name),
        standard: Standard::of_stream(stream),
        has_fps_mode: is_5_1(output["program_version"]["version"].as_str().unwrap_or("")),
    };
    let is_regular = probe.n_frames > 0 && clock_hz == fraction(&stream["r_frame_rate"]);
    let is_trimmed = probe.is_trimmed(stream, &output["format"]);
    if !is_regular || is_trimmed {
        let index = probe.stream.to_string();
        let wanted = ["-show_entries", "packet=pts_time,flags"];
        let packets = run_ffprobe(path, spec, &index, &wanted)?;
        let packets = packets["packets"].as_array().map_or(&[][..], Vec::as_slice);
        probe.count(packets, number(&output["format"]["duration"]));
        if is_trimmed {
            probe.n_promised = probe.n_frames;
        }
    }
    probe.n_promised = probe.n_promised.max(probe.n_frames);
    Ok(probe)
}

/// Returns the size of a video's pictures as they are stored, and the rotation given by its display matrix.
pub(super) fn stored(path: &Path, spec: &SourceSpec) -> Result<(Size, Turn), FootageError> {
    let wanted = ["-show_program_version", "-show_entries", ENTRIES];
    let output = run_ffprobe(path, spec, "v", &wanted)?;
    let stream = film(&output);
    let side = |key: &str| stream[key].as_u64().unwrap_or(0) as usize;
    Ok((Size::new(side("width"), side("height")), tag(stream)))
}

/// Returns the video stream of a file that is neither a cover picture, nor thumbnails, nor a single picture. If there are several such
/// streams, returns the largest one.
fn film(output: &Value) -> &Value {
    let streams = output["streams"].as_array().map_or(&[][..], Vec::as_slice);
    let rank = |stream: &Value| {
        let marks = ["attached_pic", "timed_thumbnails", "still_image"];
        let is_marked = marks.iter().any(|mark| stream["disposition"][mark] == 1);
        let is_single = stream["nb_frames"] == "1";
        let codec = stream["codec_name"].as_str().unwrap_or_default();
        let is_of_covers = INTRA[..4].contains(&codec);
        let sides = ["width", "height"].map(|name| stream[name].as_u64().unwrap_or(0));
        (!is_marked, !is_single, !is_of_covers, sides[0] * sides[1])
    };
    // The order is reversed because the first of equal streams should be selected.
    let best = streams.iter().rev().max_by_key(|stream| rank(stream));
    best.unwrap_or(&Value::Null)
}

/// Returns the rotation given by the display matrix of a stream.
fn tag(stream: &Value) -> Turn {
    let data = stream["side_data_list"].as_array().map_or(&[][..], Vec::as_slice);
    let text = data.iter().find_map(|value| value["displaymatrix"].as_str());
    // Each line is a row such as "00000000:  0  65536  0".
    let rows = text.unwrap_or_default().lines().filter_map(|line| {
        let mut numbers = line.split_once(':')?.1.split_whitespace().map(str::parse::<f64>);
        Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
    });
    match rows.collect::<Vec<_>>()[..] {
        [[a, b], [c, d], ..] => Turn::of_matrix([a, b, c, d]),
        _ => Turn::default(),
    }
}

/// Returns the time at which the decoder shows the first frame, in seconds.
///
/// If the decoding order differs from the display order, some containers store only decoding times, which the decoder shifts.
fn origin(stream: &Value, format: &Value, codec: &str) -> Option<f64> {
    let has_order = INTRA.contains(&codec) || stream["has_b_frames"] == 0;
    let starts = [stream, format].map(|value| number(&value["start_time"]));
    match starts {
        [Some(own), Some(all)] if has_order => Some(own - all),
        [None, None] if codec == "mjpeg" => Some(0.0),
        _ => None,
    }
}

impl Probe {
    /// Returns true if some stored frames are not shown, according to the shown duration. MP4 and related formats have edit lists for this.
    fn is_trimmed(&self, stream: &Value, format: &Value) -> bool {
        let names = format["format_name"].as_str().unwrap_or_default();
        let has_edits = names.split(',').any(|part| part == "mov" || part == "mp4");
        let seconds = number(&stream["duration"]).filter(|_| has_edits);
        let shown = self.clock_hz.zip(seconds).map(|(rate_hz, seconds)| rate_hz * seconds);
        shown.is_some_and(|shown| shown < self.n_frames as f64 - 0.6)
    }

    /// Determines the number and the times of the frames from the packets of the stream.
    fn count(&mut self, packets: &[Value], duration_s: Option<f64>) {
        // Packets before the first shown frame and after the last one are marked `D`, which means "discard".
        let is_discarded =
            |packet: &Value| packet["flags"].as_str().is_some_and(|flags| flags.contains('D'));
        let shown: Vec<&Value> = packets.iter().filter(|packet| !is_discarded(packet)).collect();
        let mut times_s: Vec<f64> =
            shown.iter().filter_map(|packet| number(&packet["pts_time"])).collect();
        times_s.sort_by(f64::total_cmp);
        let first_s = times_s.first().copied().unwrap_or(0.0);
        let last_s = times_s.last().copied().unwrap_or(0.0);
        let n_discarded = (packets.len() - shown.len()) as u64;
        let n_behind = self.rate_hz.zip(duration_s).map_or(0.0, |(rate_hz, duration_s)| {
            ((duration_s - last_s) * rate_hz - 1.0).round()
        });
        self.n_promised = if self.n_frames > 0 {
            self.n_frames.saturating_sub(n_discarded)
        } else {
            shown.len() as u64 + n_behind as u64
        };
        self.n_frames = shown.len() as u64;
        for time_s in &mut times_s {
            *time_s -= first_s;
        }
        self.uneven_s = uneven_s(&times_s);
        self.times_s = (!self.is_regular(&times_s)).then_some(times_s);
    }

    /// Returns the frame rate by which times of the decoder are converted to frame numbers, if the frames are equally spaced.
    pub(super) fn regular_hz(&self) -> Option<f64> {
        self.clock_hz.filter(|_| self.times_s.is_none())
    }

    /// Returns the times of all frames, if they are not equally spaced.
    pub(super) fn listed_s(&self) -> Option<&[f64]> {
        let times = self.times_s.as_deref()?;
        (times.len() as u64 == self.n_frames).then_some(times)
    }

    /// Returns the number of the frame at a time of the decoder; `None` if frames cannot be identified by their times.
    pub(super) fn frame_at(&self, time_s: f64) -> Option<u64> {
        if let Some(rate_hz) = self.regular_hz() {
            return Some((time_s * rate_hz).round() as u64);
        }
        let times = self.listed_s()?;
        let above = times.partition_point(|time| *time < time_s);
        let nearest = [above.saturating_sub(1), above.min(times.len() - 1)];
        let distance = |i: &usize| (times[*i] - time_s).abs();
        let nearest = nearest.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|nearest| nearest as u64)
    }

    /// Returns true if all frames are equally spaced. The tolerance is a quarter of a frame, because some containers round times to
    /// milliseconds.
    fn is_regular(&self, times_s: &[f64]) -> bool {
        self.clock_hz.is_some_and(|rate_hz| {
            let late = |(k, time_s): (usize, &f64)| (time_s * rate_hz - k as f64).abs();
            times_s.iter().enumerate().map(late).all(|value| value < 0.25)
        })
    }
}

/// Returns the largest difference of the times from equally spaced times between the first and the last; `None` if it is below [`UNEVEN`].
fn uneven_s(times_s: &[f64]) -> Option<f64> {
    let (first, last) = (times_s.first()?, times_s.last()?);
    let interval_s = (last - first) / (times_s.len() - 1).max(1) as f64;
    let off_s = times_s.iter().enumerate();
    let off_s = off_s.map(|(nth, time_s)| (time_s - first - nth as f64 * interval_s).abs());
    off_s.reduce(f64::max).filter(|off_s| *off_s > UNEVEN * interval_s)
}

/// Returns the frames that can be decoded without any other frame, from the packets of a stream.
///
/// # Errors
///
/// Fails if the file cannot be read.
pub(super) fn key_frames(
    path: &Path,
    spec: &SourceSpec,
    probe: &Probe,
) -> Result<Vec<u64>, FootageError> {
    let wanted = ["-show_entries", "packet=pts_time,flags"];
    let packets = run_ffprobe(path, spec, &probe.stream.to_string(), &wanted)?;
    let packets = packets["packets"].as_array().map_or(&[][..], Vec::as_slice);
    let flags = |value: &Value| value["flags"].as_str().unwrap_or_default().to_owned();
    let mut shown: Vec<(f64, String)> = packets
        .iter()
        .map(|packet| (number(&packet["pts_time"]).unwrap_or(0.0), flags(packet)))
        .filter(|packet| !packet.1.contains('D'))
        .collect();
    shown.sort_by(|a, b| a.0.total_cmp(&b.0));
    let numbered = (0..).zip(shown);
    Ok(numbered
        .filter(|numbered| numbered.1.1.contains('K'))
        .map(|numbered| numbered.0)
        .collect())
}

pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_str()?.parse().ok()
}

/// Parses a fraction such as `"60000/1001"`; `"0/0"` means unknown.
pub(crate) fn fraction(value: &Value) -> Option<f64> {
    let (numerator, denominator) = value.as_str()?.split_once('/')?;
    let rate = numerator.parse::<f64>().ok()? / denominator.parse::<f64>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// Returns true if `ffmpeg` is of version 5.1 or later, which has `-fps_mode` and writes the times of sender reports.
///
/// * `version`: for example `5.1.9-0+deb12u1`, `n7.0`, `4.4.2-0ubuntu0.22.04.1`. Builds without a version number are assumed to be recent.
pub(crate) fn is_5_1(version: &str) -> bool {
    let mut numbers = version
        .trim_start_matches('n')
        .split(|letter: char| !letter.is_ascii_digit())
        .map(str::parse::<u32>);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => (major, minor) >= (5, 1),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_depends_on_the_version_of_ffmpeg() {
        for (version, expect) in [
            ("5.1.9-0+deb12u1", true),
            ("n7.0", true),
            ("5.0.1", false),
            ("4.4.2-0ubuntu0.22.04.1", false),
            ("N-112345-gabcdef", true),
            ("", true),
        ] {
            assert_eq!(is_5_1(version), expect, "{version}");
        }
    }

    #[test]
    fn a_dropped_frame_makes_times_uneven_and_jitter_does_not() {
        let jitter = |nth: u32| 0.004 * f64::from(nth * 7 % 3);
        let regular: Vec<f64> = (0..100).map(|nth| f64::from(nth) / 30.0 + jitter(nth)).collect();
        assert_eq!(uneven_s(&regular), None);
        let mut dropped: Vec<f64> = (0..100).map(|nth| f64::from(nth) / 30.0).collect();
        dropped.remove(50);
        let off_s = uneven_s(&dropped).unwrap();
        assert!((0.016..0.018).contains(&off_s), "{off_s}");
        for few in [&[][..], &[0.0], &[0.0, 0.4]] {
            assert_eq!(uneven_s(few), None);
        }
    }

    #[test]
    fn an_unknown_rate_is_no_rate() {
        assert_eq!(fraction(&"60000/1001".into()), Some(60000.0 / 1001.0));
        for unknown in ["0/0", "0/1", "25", "x/y", ""] {
            assert_eq!(fraction(&unknown.into()), None, "{unknown}");
        }
    }
}
