//! Selects the frames of a stream that are processed, and counts the lost ones.

use crate::join::Cadence;
use messages::{FrameHeader, Status};
use runtime::Delivery;

/// Largest gap between frame numbers that counts as lost frames. A larger gap means that a frame number is wrong.
const MAX_GAP: u64 = 1 << 16;

/// Chooses and counts the frames of one view as they arrive.
#[derive(Debug)]
pub(crate) struct Intake {
    delivery: Delivery,
    start_frame: u64,
    frame_step: u64,
    cadence: Cadence,
    past: Past,
    last_frame: Option<u64>,
}

/// The progress of a view, kept in a file for the next epoch of the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Past {
    /// Number of the frame that is expected next.
    next: u64,
    /// Number of frames that the camera has dropped.
    n_dropped: u64,
    /// Epoch (number of restarts) of the capture process, whose count begins at 0 in every epoch.
    camera_epoch: u32,
}

impl Past {
    /// Returns the progress as three numbers.
    pub(crate) fn numbers(self) -> [u64; 3] {
        [self.next, self.n_dropped, self.camera_epoch.into()]
    }

    /// Creates the progress from three numbers.
    pub(crate) fn from_numbers([next, n_dropped, camera_epoch]: [u64; 3]) -> Self {
        Self {
            next,
            n_dropped,
            camera_epoch: camera_epoch as u32,
        }
    }
}

impl Intake {
    /// Creates an intake, which selects the frames to process.
    ///
    /// * `past`: progress made before the process was restarted.
    pub(crate) fn new(delivery: Delivery, [start_frame, frame_step]: [u64; 2], past: Past) -> Self {
        Self {
            delivery,
            start_frame,
            frame_step: frame_step.max(1),
            cadence: Cadence::default(),
            past,
            last_frame: None,
        }
    }

    /// Returns the progress so far.
    pub(crate) fn past(&self) -> Past {
        self.past
    }

    /// Returns true if a frame has to be processed. This is not the case if the frame was only sent again for another receiver, or if the
    /// cadence skips it.
    pub(crate) fn takes(&self, header: &FrameHeader) -> bool {
        let frame = header.stamp.frame;
        self.last_frame != Some(frame)
            && (self.delivery == Delivery::Lossless
                || header.status != Status::OK
                || self.cadence.takes(self.nth(frame)))
    }

    /// Returns the number of lost frames before this one (or before the end of stream): those that were not received although capture did
    /// not drop them.
    pub(crate) fn n_lost_before(&mut self, header: &FrameHeader) -> u64 {
        let nth = self.nth(header.stamp.frame);
        let skipped = nth.saturating_sub(self.past.next);
        if skipped > MAX_GAP {
            return 0;
        }
        let is_same_camera = header.stamp.epoch == self.past.camera_epoch;
        let before = if is_same_camera {
            self.past.n_dropped
        } else {
            0
        };
        let dropped = header.n_dropped.saturating_sub(before);
        self.past = Past {
            next: (nth + 1).max(self.past.next),
            n_dropped: header.n_dropped,
            camera_epoch: header.stamp.epoch,
        };
        skipped.saturating_sub(dropped)
    }

    /// Records that a frame was processed, and the time that this took.
    pub(crate) fn processed(&mut self, header: &FrameHeader, busy_nanos: u64) {
        let frame = header.stamp.frame;
        self.last_frame = Some(frame);
        let stride = self.cadence.stride();
        self.cadence
            .processed(self.nth(frame), header.stamp.captured_at_nanos, busy_nanos);
        if self.delivery == Delivery::Realtime && self.cadence.stride() != stride {
            tracing::info!(
                frame,
                every = self.cadence.stride(),
                "the cadence has changed"
            );
        }
    }

    /// Returns the position of a frame among the used frames.
    pub(crate) fn nth(&self, frame: u64) -> u64 {
        frame.saturating_sub(self.start_frame) / self.frame_step
    }
}

#[cfg(test)]
mod tests {
    use messages::Stamp;

    use super::*;

    /// Returns the header of frame `nth` of footage at 10 Hz, of which every third frame is used, starting at frame 6.
    fn header(nth: u64, n_dropped: u64) -> FrameHeader {
        FrameHeader {
            stamp: Stamp {
                frame: 6 + 3 * nth,
                captured_at_nanos: nth.wrapping_mul(100_000_000),
                ..Stamp::default()
            },
            n_dropped,
            ..FrameHeader::default()
        }
    }

    fn intake(delivery: Delivery) -> Intake {
        Intake::new(delivery, [6, 3], Past::default())
    }

    #[test]
    fn every_frame_is_processed_or_dropped_by_the_camera_or_lost() {
        let mut intake = intake(Delivery::Realtime);
        // Frames 0, 1 and 5 are lost, the camera drops 3 and 4, and 7 and 8 are lost before the end.
        assert_eq!(intake.n_lost_before(&header(2, 0)), 2);
        assert_eq!(intake.n_lost_before(&header(6, 2)), 1);
        assert_eq!(intake.n_lost_before(&header(9, 2)), 2);
    }

    #[test]
    fn a_restarted_process_counts_the_frames_since_its_last_epoch() {
        let mut first = intake(Delivery::Realtime);
        assert_eq!(first.n_lost_before(&header(20, 18)), 2);
        let past = Past::from_numbers(first.past().numbers());
        let mut second = Intake::new(Delivery::Realtime, [6, 3], past);
        // The first process held frame 21 when it was killed. The camera dropped 22, and 23 and 24 were not received.
        assert_eq!(second.n_lost_before(&header(25, 19)), 3);
        assert_eq!(second.n_lost_before(&header(26, 19)), 0);
    }

    #[test]
    fn a_restarted_camera_counts_from_0() {
        let mut intake = intake(Delivery::Realtime);
        let restarted = |nth, n_dropped| {
            let mut header = header(nth, n_dropped);
            header.stamp.epoch = 1;
            header
        };
        assert_eq!(intake.n_lost_before(&header(4, 4)), 0);
        // The new epoch has dropped five frames: 5 to 9.
        assert_eq!(intake.n_lost_before(&restarted(10, 5)), 0);
        assert_eq!(intake.n_lost_before(&restarted(12, 5)), 1);
        assert_eq!(intake.n_lost_before(&restarted(14, 6)), 0);
    }

    #[test]
    fn one_wrong_frame_number_does_not_count_as_lost_frames() {
        let mut intake = intake(Delivery::Lossless);
        assert_eq!(intake.n_lost_before(&header(0, 0)), 0);
        intake.processed(&header(0, 0), 1);
        assert_eq!(intake.n_lost_before(&header(1 << 38, 0)), 0);
        intake.processed(&header(1 << 38, 0), 1);
        assert!(intake.takes(&header(1, 0)));
        assert_eq!(intake.n_lost_before(&header(1, 0)), 0);
        assert_eq!(intake.n_lost_before(&header(3, 0)), 1);
    }

    #[test]
    fn a_frame_that_is_sent_again_is_processed_once() {
        let mut intake = intake(Delivery::Lossless);
        assert!(intake.takes(&header(0, 0)));
        intake.processed(&header(0, 0), 1);
        assert!(!intake.takes(&header(0, 0)));
        assert!(intake.takes(&header(1, 0)));
    }

    #[test]
    fn a_slow_stage_skips_frames_only_if_loss_is_allowed() {
        for (delivery, expected) in [(Delivery::Realtime, false), (Delivery::Lossless, true)] {
            let mut intake = intake(delivery);
            for nth in [0, 2, 4, 6] {
                intake.processed(&header(nth, 0), 150_000_000);
            }
            assert_eq!(intake.takes(&header(7, 0)), expected);
            assert!(intake.takes(&header(8, 0)));
        }
    }
}
