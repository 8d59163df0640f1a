//! The disk space that a recording needs, and the free disk space.

use core::fmt::Write as _;
use core::time::Duration;
use std::path::{Path, PathBuf};
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use recording::Kind;
use runtime::{TopicPlan, free_space};

/// A recording starts only if there is space for this many frames.
const MIN_FRAMES: u64 = 10;
/// Size of a Foxglove message with a skeleton, in bytes.
const SCENE_BYTES: u64 = 24_000;
/// Interval between messages to the user about the size of the file.
const PERIOD: Duration = Duration::from_secs(10);

/// Maximum size of the messages about one frame, over all views, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct PerFrame {
    pub pixels: u64,
    pub evidence: u64,
    /// The frames' pixels as JPEG for Foxglove, encoded as text.
    pub foxglove: u64,
    /// Original pictures of live cameras, if the cameras send raw pixels.
    pub camera: u64,
    /// All other messages.
    pub rest: u64,
}

impl PerFrame {
    /// Computes the sizes for the topics of a deployment.
    ///
    /// * `has_foxglove`: true if the recording contains the topics for Foxglove.
    pub(super) fn new(topics: &[TopicPlan], has_foxglove: bool) -> Self {
        let mut sum = Self::default();
        for topic in topics {
            let bytes = topic.message_bytes();
            match Kind::of_topic(topic.topic()) {
                Some(Kind::Frame) => {
                    sum.pixels += bytes;
                    sum.foxglove += if has_foxglove { bytes / 2 } else { 0 };
                }
                Some(Kind::Skeletons) => {
                    // The topic has space for eight people, but the recording contains only the people in the frame. A run follows one
                    // person.
                    let person = Kind::Skeletons.element_bytes().unwrap_or(0);
                    sum.rest += (Kind::Skeletons.head_bytes() + person) as u64;
                    sum.rest += if has_foxglove { SCENE_BYTES } else { 0 };
                }
                Some(Kind::Evidence) => sum.evidence += bytes,
                Some(Kind::Picture) => sum.camera += bytes,
                // Health messages are few and small.
                None | Some(Kind::Health) => {}
                Some(_) => sum.rest += bytes,
            }
        }
        sum
    }

    /// Returns the total size, without pixels or evidence if these are left out.
    fn bytes(self, without: [bool; 2]) -> u64 {
        let [pixels, evidence] = without;
        let pixels = if pixels {
            0
        } else {
            self.pixels + self.foxglove
        };
        let evidence = if evidence { 0 } else { self.evidence };
        pixels + evidence + self.camera + self.rest
    }
}

/// The expected size of a recording, and the free disk space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Forecast {
    pub per_frame: PerFrame,
    /// Flags for the parts that are left out: pixels, and evidence.
    pub without: [bool; 2],
    /// Number of frames; `None` for a run without an end.
    pub n_frames: Option<u64>,
    /// Rate of the frames that are used, per second, if known.
    pub rate_hz: Option<f64>,
    pub free_bytes: u64,
}

impl Forecast {
    /// Returns the size of the messages about one frame, in bytes.
    fn frame_bytes(&self) -> u64 {
        self.per_frame.bytes(self.without)
    }

    /// Returns the number of frames that fit on the disk.
    fn n_that_fit(&self) -> u64 {
        self.free_bytes / self.frame_bytes().max(1)
    }

    /// Returns the forecast as text.
    pub(super) fn text(&self, file: &Path) -> String {
        let mut text = format!(
            "recording {}: up to {} per frame",
            file.display(),
            size(self.frame_bytes())
        );
        // Writing to a string cannot fail.
        let _infallible = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> core::fmt::Result {
        if let Some(rate) = self.rate_hz {
            let second = (self.frame_bytes() as f64 * rate) as u64;
            write!(text, ", {} per second of {rate:.0} frames", size(second))?;
        }
        if let Some(n_frames) = self.n_frames {
            let all = size(self.frame_bytes().saturating_mul(n_frames));
            write!(text, ", {all} for all {n_frames} frames")?;
        }
        write!(text, "; {} are free", size(self.free_bytes))?;
        if self.n_frames.is_none_or(|frame| self.n_that_fit() < frame) {
            write!(text, ", enough for at least {} frames", self.n_that_fit())?;
        }
        self.write_smaller(text)
    }

    /// Appends the size of the recording without evidence, and its size without evidence and pixels.
    fn write_smaller(&self, text: &mut String) -> core::fmt::Result {
        let [pixels, evidence] = self.without;
        if !evidence {
            let left = self.per_frame.bytes([pixels, true]);
            write!(text, "\n  --without evidence: {} per frame", size(left))?;
        }
        if !evidence && !pixels {
            let left = self.per_frame.bytes([true, true]);
            write!(text, "; and --without pixels: {}", size(left))?;
        } else if !pixels {
            let left = self.per_frame.bytes([true, true]);
            write!(text, "\n  also --without pixels: {} per frame", size(left))?;
        }
        Ok(())
    }

    /// Checks that there is space for a few frames.
    pub(super) fn check(&self, file: &Path) -> Result<(), Failure> {
        let n = self.n_frames.map_or(MIN_FRAMES, |frame| frame.min(MIN_FRAMES));
        if self.n_that_fit() >= n {
            return Ok(());
        }
        let message = format!(
            "not enough disk space for {}: {n} frames of {} need {}, but only {} are free",
            file.display(),
            size(self.frame_bytes()),
            size(self.frame_bytes().saturating_mul(n)),
            size(self.free_bytes)
        );
        let mut hint = "free some space, or choose a file on another disk".to_owned();
        // Writing to a string cannot fail.
        let _infallible = self.write_smaller(&mut hint);
        Err(Failure::new(ExitKind::Input, message).with_hint(hint))
    }
}

/// Returns the free space on the disk of a file that will be written, in bytes.
pub(super) fn free_beside(file: &Path) -> Result<u64, Failure> {
    let folder = file.parent().unwrap_or(Path::new("/"));
    if !folder.is_dir() {
        let message = format!(
            "{} cannot be written: there is no folder {}",
            file.display(),
            folder.display()
        );
        let failure = Failure::new(ExitKind::Input, message);
        return Err(failure.with_hint("create the folder first, or choose another file"));
    }
    free_space(folder).or_fail(ExitKind::Input)
}

/// Reports the size of the file every few seconds.
#[derive(Debug)]
pub(super) struct Growth {
    file: PathBuf,
    frame_bytes: u64,
    reported_at: Instant,
}

impl Growth {
    pub(super) fn new(file: &Path, forecast: &Forecast) -> Self {
        Self {
            file: file.to_owned(),
            frame_bytes: forecast.frame_bytes().max(1),
            reported_at: Instant::now(),
        }
    }

    /// Returns the next message if it is due. Called on every event of the run.
    pub(super) fn message(&mut self) -> Option<String> {
        if self.reported_at.elapsed() < PERIOD {
            return None;
        }
        self.reported_at = Instant::now();
        let bytes = std::fs::metadata(&self.file).ok()?.len();
        let free = free_space(&self.file).ok()?;
        let n = free / self.frame_bytes;
        Some(format!(
            "recorded {}; {} are free, enough for at least {n} frames",
            size(bytes),
            size(free)
        ))
    }
}

/// Formats a number of bytes in decimal units.
fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let unit = units.into_iter().find(|unit| bytes >= unit.0);
    unit.map_or_else(
        || format!("{bytes:.0} bytes"),
        |(of, name)| format!("{:.1} {name}", bytes / of),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forecast(free_bytes: u64, without: [bool; 2]) -> Forecast {
        Forecast {
            per_frame: PerFrame {
                pixels: 4_000_000,
                evidence: 168_000_000,
                foxglove: 0,
                camera: 0,
                rest: 400_000,
            },
            without,
            n_frames: Some(100),
            rate_hz: Some(60.0),
            free_bytes,
        }
    }

    #[test]
    fn the_forecast_shows_the_size_and_smaller_options() {
        let text = forecast(70_000_000_000, [false; 2]).text(Path::new("run.mcap"));
        assert_eq!(
            text,
            "recording run.mcap: up to 172.4 MB per frame, 10.3 GB per second of 60 frames, 17.2 GB for all 100 frames; \
             70.0 GB are free\n  --without evidence: 4.4 MB per frame; and --without pixels: 400.0 kB"
        );
        let text = forecast(70_000_000_000, [false, true]).text(Path::new("run.mcap"));
        assert!(
            text.ends_with("\n  also --without pixels: 400.0 kB per frame"),
            "{text}"
        );
        let text = forecast(70_000_000_000, [true; 2]).text(Path::new("run.mcap"));
        assert!(!text.contains("--without"), "{text}");
    }

    #[test]
    fn the_forecast_warns_of_a_full_disk() {
        let small = forecast(5_000_000_000, [false; 2]);
        assert!(
            small
                .text(Path::new("a"))
                .contains("5.0 GB are free, enough for at least 29 frames")
        );
        let endless = Forecast {
            n_frames: None,
            ..small
        };
        let text = endless.text(Path::new("a"));
        assert!(
            text.contains("frames; 5.0 GB are free, enough for at least 29 frames"),
            "{text}"
        );
        small.check(Path::new("a")).unwrap();
    }

    #[test]
    fn too_little_space_for_a_few_frames_is_refused() {
        let refused = forecast(1_723_999_999, [false; 2]).check(Path::new("a")).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "not enough disk space for a: 10 frames of 172.4 MB need 1.7 GB, but only 1.7 GB are free"
        );
        forecast(1_724_000_000, [false; 2]).check(Path::new("a")).unwrap();
        forecast(1_723_999_999, [false, true]).check(Path::new("a")).unwrap();
        let few = Forecast {
            n_frames: Some(2),
            ..forecast(400_000_000, [false; 2])
        };
        few.check(Path::new("a")).unwrap();
    }
}
