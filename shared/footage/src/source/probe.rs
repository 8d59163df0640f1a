//! The properties of a video, from `ffprobe`.

use std::io;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::{FootageError, Size, SourceSpec};

/// What is known of a video before it is decoded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Probe {
    /// Size as stored: a rotation tag is not applied.
    pub(super) size: Size,
    pub(super) rate_hz: Option<f64>,
    /// Frames in the stream, from the container or by counting packets.
    pub(super) n_frames: u64,
    /// Frames according to the duration in the header.
    pub(super) n_promised: u64,
    /// Presentation times, seconds after the first frame, where frames are not equally spaced.
    pub(super) times_s: Option<Vec<f64>>,
    /// Whether the option that keeps every frame is called `-fps_mode` (since 5.1) or `-vsync`.
    pub(super) has_fps_mode: bool,
}

/// The first video stream of a file.
const PICTURES: &str = "v:0";
const ENTRIES: &str = "program_version=version:\
    stream=width,height,nb_frames,avg_frame_rate,r_frame_rate:format=duration";

/// Probes the first video stream of `path`. Reads the whole file (without decoding) only if the
/// container does not have the number of frames, or may not have equally spaced ones.
pub(super) fn probe(path: &Path, spec: &SourceSpec) -> Result<Probe, FootageError> {
    let wanted = ["-show_program_version", "-show_entries", ENTRIES];
    let output = run_ffprobe(path, spec, PICTURES, &wanted)?;
    let stream = &output["streams"][0];
    let side = |key: &str| stream[key].as_u64().unwrap_or(0) as usize;
    let size = Size::new(side("width"), side("height"));
    if size.rgb_bytes() == 0 {
        return Err(FootageError::Video {
            path: path.to_path_buf(),
            message: "it has no video stream".to_owned(),
        });
    }
    let rate_hz = fraction(&stream["avg_frame_rate"]);
    let mut probe = Probe {
        size,
        rate_hz,
        n_frames: number(&stream["nb_frames"]).map_or(0, |it| it as u64),
        n_promised: 0,
        times_s: None,
        has_fps_mode: is_5_1(output["program_version"]["version"].as_str().unwrap_or("")),
    };
    if probe.n_frames == 0 || rate_hz != fraction(&stream["r_frame_rate"]) {
        let packets = run_ffprobe(
            path,
            spec,
            PICTURES,
            &["-show_entries", "packet=pts_time,flags"],
        )?;
        let packets = packets["packets"].as_array().map_or(&[][..], Vec::as_slice);
        probe.count(packets, number(&output["format"]["duration"]));
    }
    probe.n_promised = probe.n_promised.max(probe.n_frames);
    Ok(probe)
}

impl Probe {
    /// Determines the number and the times of the frames from the packets of the stream.
    fn count(&mut self, packets: &[Value], duration_s: Option<f64>) {
        // Packets in front of the first frame that is shown are marked `D`, to be discarded.
        let is_discarded = |packet: &Value| {
            packet["flags"]
                .as_str()
                .is_some_and(|flags| flags.contains('D'))
        };
        let shown: Vec<&Value> = packets.iter().filter(|it| !is_discarded(it)).collect();
        let mut times_s: Vec<f64> = shown
            .iter()
            .filter_map(|packet| number(&packet["pts_time"]))
            .collect();
        times_s.sort_by(f64::total_cmp);
        let first_s = times_s.first().copied().unwrap_or(0.0);
        let last_s = times_s.last().copied().unwrap_or(0.0);
        let n_discarded = (packets.len() - shown.len()) as u64;
        let n_behind = self
            .rate_hz
            .zip(duration_s)
            .map_or(0.0, |(rate_hz, duration_s)| {
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
        self.times_s = (!self.is_regular(&times_s)).then_some(times_s);
    }

    /// The rate, where frames are equally spaced.
    pub(super) fn regular_hz(&self) -> Option<f64> {
        self.rate_hz.filter(|_| self.times_s.is_none())
    }

    /// Whether all frames are equally spaced, to a quarter of a frame, because some containers round times to
    /// milliseconds.
    fn is_regular(&self, times_s: &[f64]) -> bool {
        self.rate_hz.is_some_and(|rate_hz| {
            let late = |(k, time_s): (usize, &f64)| (time_s * rate_hz - k as f64).abs();
            times_s.iter().enumerate().map(late).all(|it| it < 0.25)
        })
    }
}

/// Asks `ffprobe` about a stream of a file.
pub(super) fn run_ffprobe(
    path: &Path,
    spec: &SourceSpec,
    stream: &str,
    wanted: &[&str],
) -> Result<Value, FootageError> {
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(&spec.ffprobe)
        .args(["-v", "error", "-select_streams", stream, "-of", "json"])
        .args(wanted)
        .arg(input_name(path))
        .stdin(Stdio::null())
        .output()
        .map_err(|source| missing(&spec.ffprobe, path, source))?;
    let unreadable = |message: String| FootageError::Video {
        path: path.to_path_buf(),
        message,
    };
    if !status.success() {
        return Err(unreadable(super::log::summary(&stderr)));
    }
    serde_json::from_slice(&stdout)
        .map_err(|error| unreadable(format!("the output of ffprobe is not JSON: {error}")))
}

/// The name of a file for ffmpeg, protected against names such as `concat:x` and `-x`.
pub(super) fn input_name(path: &Path) -> std::ffi::OsString {
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

pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_str()?.parse().ok()
}

/// `"60000/1001"`; `"0/0"` means unknown.
pub(crate) fn fraction(value: &Value) -> Option<f64> {
    let (numerator, denominator) = value.as_str()?.split_once('/')?;
    let rate = numerator.parse::<f64>().ok()? / denominator.parse::<f64>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// Whether `ffmpeg` is of version 5.1 or later, which has `-fps_mode` and writes the times of sender reports.
///
/// * `version`: `5.1.9-0+deb12u1`, `n7.0`, `4.4.2-0ubuntu0.22.04.1`; builds without a number are assumed to be recent.
pub(crate) fn is_5_1(version: &str) -> bool {
    let mut numbers = version
        .trim_start_matches('n')
        .split(|it: char| !it.is_ascii_digit())
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
    fn an_unknown_rate_is_no_rate() {
        assert_eq!(fraction(&"60000/1001".into()), Some(60000.0 / 1001.0));
        for unknown in ["0/0", "0/1", "25", "x/y", ""] {
            assert_eq!(fraction(&unknown.into()), None, "{unknown}");
        }
    }
}
