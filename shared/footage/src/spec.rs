//! The footage to open, and which of its frames to read.

use std::path::PathBuf;

use crate::{FootageError, Rotation};

/// The numbers in the names of pictures that belong to frames: `first`, `first + step`, ...
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureNumbers {
    /// Number in the name of frame 0.
    pub first: u64,
    /// Difference between the numbers of neighbouring frames, at least 1.
    pub step: u64,
}

/// Footage as specified by the user, and which of its frames to read.
///
/// Frames are counted from 0 in the order of the footage. The frames that are read are `start`,
/// `start + step`, `start + 2 step`, ..., at most `count` of them.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceSpec {
    /// Path of a folder of images, a glob (`frames/*.png`), a numbered pattern (`frames/%05d.png`),
    /// an image or a video. A path that exists is never interpreted as a pattern, whatever it contains.
    pub path: String,
    /// First frame, counted from 0.
    pub start: u64,
    /// Distance between frames, at least 1.
    pub step: u64,
    /// Maximum number of frames to read, at least 1; if not set, all frames. A still image is repeated this many times (read once if not
    /// set).
    pub count: Option<u64>,
    /// Frames per second of footage that has no rate of its own: images, but not videos.
    pub frame_rate_hz: Option<f64>,
    /// The numbers in the names of pictures that belong to frames; a number without a picture is then a missing frame. If not set, the
    /// pictures are numbered in order, regardless of their names.
    pub numbers: Option<PictureNumbers>,
    /// How the pictures are rotated.
    pub rotation: Rotation,
    /// Maximum factor by which the pictures of a video may be shrunk when they are decoded.
    ///
    /// The factor is the largest whole number up to this maximum that divides both sides of the pictures. Each pixel is the mean of the
    /// pixels that it covers. With 1, the pictures are not shrunk.
    pub most_shrink: usize,
    /// Number of threads that decode a video; by default, the decoder chooses.
    pub threads: Option<usize>,
    /// Minimum width and height of pictures before shrinking, in pixels.
    pub min_side: usize,
    /// The `ffmpeg` executable, a name on the search path or a path. Needed only for videos.
    pub ffmpeg: PathBuf,
    /// The `ffprobe` executable, a name on the search path or a path. Needed only for videos.
    pub ffprobe: PathBuf,
}

impl SourceSpec {
    /// Selects all frames of `path`, of any size, with the `ffmpeg` and `ffprobe` on the search path.
    pub fn new(path: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            start: 0,
            step: 1,
            count: None,
            frame_rate_hz: None,
            numbers: None,
            rotation: Rotation::Stored,
            most_shrink: 1,
            threads: None,
            min_side: 1,
            ffmpeg: "ffmpeg".into(),
            ffprobe: "ffprobe".into(),
        }
    }

    /// Selects the same frames as [`Self::new`], with pictures rotated as video players show them.
    pub fn upright(path: impl Into<String>) -> Self {
        Self {
            rotation: Rotation::Tag,
            ..Self::new(path)
        }
    }

    /// Returns an error for values that are invalid for any footage.
    pub(crate) fn check(&self) -> Result<(), FootageError> {
        if self.step == 0 {
            return Err(FootageError::ZeroStep);
        }
        if self.count == Some(0) {
            return Err(FootageError::ZeroCount);
        }
        match self.frame_rate_hz {
            Some(rate_hz) if !(rate_hz.is_finite() && rate_hz > 0.0) => {
                Err(FootageError::BadRate { rate_hz })
            }
            _ => Ok(()),
        }
    }

    /// Returns how many of `n_frames` are read.
    ///
    /// # Errors
    ///
    /// Returns a [`FootageError`] if a value is invalid, or if the first frame is after the end of the footage.
    pub fn n_delivered(&self, n_frames: u64) -> Result<u64, FootageError> {
        self.check()?;
        if self.start >= n_frames {
            return Err(FootageError::StartBeyondEnd {
                path: self.path.clone(),
                start: self.start,
                n_frames,
            });
        }
        let available = (n_frames - self.start).div_ceil(self.step);
        Ok(self.count.map_or(available, |count| count.min(available)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delivered(start: u64, step: u64, count: Option<u64>) -> Option<u64> {
        let spec = SourceSpec {
            start,
            step,
            count,
            ..SourceSpec::new("x")
        };
        spec.n_delivered(10).ok()
    }

    #[test]
    fn start_step_and_count_determine_the_number_of_frames() {
        assert_eq!(delivered(0, 1, None), Some(10));
        assert_eq!(delivered(9, 1, None), Some(1));
        assert_eq!(delivered(10, 1, None), None);
        assert_eq!(delivered(0, 3, None), Some(4)); // 0 3 6 9
        assert_eq!(delivered(1, 3, None), Some(3)); // 1 4 7
        assert_eq!(delivered(1, 3, Some(2)), Some(2));
        assert_eq!(delivered(1, 3, Some(9)), Some(3));
        assert_eq!(delivered(0, u64::MAX, Some(9)), Some(1));
    }

    #[test]
    fn refuses_a_count_of_zero() {
        let none = SourceSpec {
            count: Some(0),
            ..SourceSpec::new("x")
        };
        assert!(matches!(none.check(), Err(FootageError::ZeroCount)));
    }

    #[test]
    fn refuses_a_step_of_zero_and_a_rate_that_is_not_positive() {
        let zero_step = SourceSpec {
            step: 0,
            ..SourceSpec::new("x")
        };
        assert!(matches!(zero_step.check(), Err(FootageError::ZeroStep)));
        for rate_hz in [0.0, -25.0, f64::NAN, f64::INFINITY] {
            let spec = SourceSpec {
                frame_rate_hz: Some(rate_hz),
                ..SourceSpec::new("x")
            };
            assert!(matches!(spec.check(), Err(FootageError::BadRate { .. })));
        }
    }
}
