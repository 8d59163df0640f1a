//! Synchronisation of the streams of a trial.

use crate::datasets::sequences::SyncError;

/// The content of an `.ofs` file: a camera frame, the motion capture frame at the same time, and the
/// number of motion capture frames per camera frame. Frames are numbered from 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Offset {
    pub(crate) image: f64,
    pub(crate) motion: f64,
    pub(crate) rate: f64,
}

impl Offset {
    /// Parses three numbers separated by blanks or line breaks; `None` if the text is anything else.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let numbers: Vec<f64> = text
            .split_whitespace()
            .map_while(|word| word.parse().ok())
            .filter(|value: &f64| value.is_finite())
            .collect();
        match numbers[..] {
            [image, motion, rate, ..] => Some(Self {
                image,
                motion,
                rate,
            }),
            _ => None,
        }
    }
}

/// The temporal alignment of the streams of a trial.
///
/// It follows the toolbox of the data set (version 1.1). The first camera with an offset defines the time, the
/// rates of all cameras are averaged, and frame 1 is the first frame of the earliest camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sync {
    /// Motion capture frame (from 1, fractional) that corresponds to frame 1 of the trial.
    pub motion_first: f64,
    /// Motion capture frames per frame of the trial.
    pub motion_rate: f64,
    /// For each camera, the number (from 1) of the footage frame that corresponds to frame 1 of the trial; `None` for a camera without an
    /// offset.
    pub image_first: Vec<Option<u64>>,
}

impl Sync {
    /// * `offsets`: offsets of all cameras of the trial, in the toolbox's order (`C1` to `C3`, then `BW1` to `BW4`). The offsets of cameras
    ///   that are not evaluated are needed, too.
    pub(crate) fn new(offsets: &[Option<Offset>]) -> Result<Self, SyncError> {
        let known: Vec<&Offset> = offsets.iter().flatten().collect();
        let first = *known.first().ok_or(SyncError::Nothing)?;
        if let Some(offset) = known.iter().find(|offset| offset.rate <= 0.0) {
            return Err(SyncError::Rate { rate: offset.rate });
        }
        let begin = |offset: &Offset| offset.image + (first.motion - offset.motion) / offset.rate;
        let rate = known.iter().map(|offset| offset.rate).sum::<f64>() / known.len() as f64;
        let earliest = known.iter().map(|offset| begin(offset));
        let earliest = earliest.fold(f64::INFINITY, f64::min);
        let mut motion = first.motion - rate * (earliest - 1.0);
        let mut shift = 1.0 - earliest;
        if motion < 1.0 {
            shift -= (motion - 1.0) / rate;
            motion = 1.0;
        }
        let frame = |offset: &Option<Offset>| {
            let Some(offset) = offset else {
                return Ok(None);
            };
            let offset = (begin(offset) + shift).round();
            if offset < 1.0 {
                return Err(SyncError::Before { offset });
            }
            Ok(Some(offset as u64))
        };
        Ok(Self {
            motion_first: motion,
            motion_rate: rate,
            image_first: offsets.iter().map(frame).collect::<Result<_, _>>()?,
        })
    }

    /// Motion capture frame (from 1, fractional) that corresponds to a frame of the trial (from 1).
    pub fn motion_at(&self, frame: u64) -> f64 {
        self.motion_first + (frame as f64 - 1.0) * self.motion_rate
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn offset(image: f64, motion: f64, rate: f64) -> Offset {
        Offset {
            image,
            motion,
            rate,
        }
    }

    #[test]
    fn cameras_that_started_later_skip_fewer_frames() {
        // At motion capture frame 101, the first camera is at frame 11 and the second at 31: it began 20 frames earlier.
        let got = Sync::new(&[11.0, 31.0].map(|value| Some(offset(value, 101.0, 2.0)))).unwrap();
        assert_eq!(got.image_first, [Some(1), Some(21)]);
        assert_eq!((got.motion_first, got.motion_rate), (81.0, 2.0));
        assert_eq!(got.motion_at(11), 101.0);
    }

    #[test]
    fn motion_capture_that_started_later_shifts_all_cameras() {
        let got = Sync::new(&[None, Some(offset(11.0, 5.0, 2.0))]).unwrap();
        // Frame 11 corresponds to frame 5, so frame 9 corresponds to frame 1.
        assert_eq!(
            (got.motion_first, got.image_first),
            (1.0, vec![None, Some(9)])
        );
    }

    #[test]
    fn missing_offsets_and_rates_of_0_are_refused() {
        assert_eq!(Sync::new(&[None, None]), Err(SyncError::Nothing));
        let got = Sync::new(&[Some(offset(1.0, 1.0, 0.0))]);
        assert_eq!(got, Err(SyncError::Rate { rate: 0.0 }));
    }

    #[test]
    fn an_offset_consists_of_three_numbers() {
        assert_eq!(
            Offset::parse("73\n82.5 1.9996\n"),
            Some(offset(73.0, 82.5, 1.9996))
        );
        assert_eq!(Offset::parse("73\nx 2"), None);
        assert_eq!(Offset::parse("1 2 inf"), None);
    }

    proptest! {
        #[test]
        fn the_correspondence_of_every_offset_is_kept(
            image in 1.0..500.0_f64,
            motion in 1.0..1000.0_f64,
            other in 1.0..500.0_f64,
        ) {
            let got = Sync::new(&[image, other].map(|image| Some(offset(image, motion, 2.0)))).unwrap();
            for (first, image_frame) in got.image_first.iter().zip([image, other]) {
                // The frame of the trial at which this camera shows frame `image_frame`.
                let frame = image_frame - first.unwrap() as f64 + 1.0;
                let at = got.motion_first + (frame - 1.0) * 2.0;
                prop_assert!((at - motion).abs() <= 1.0 + 1e-9, "rounded to whole frames");
            }
        }
    }
}
