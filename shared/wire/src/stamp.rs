//! Checks the stamps of messages: session, sender and time.

use messages::{FrameHeader, Stamp, Status, Timing};

use crate::WireError;
use crate::error::equal;

/// Maximum time by which a time stamp may be ahead of the clock. This is generous, because all processes of a machine use the same clock.
const SLACK_NANOS: u64 = 1_000_000_000;
/// Limit of the frame number; no camera ever captures so many frames.
const MOST_FRAMES: u64 = 1 << 40;

/// The stamp that the receiver of a topic expects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// Session of the receiver.
    pub session: u64,
    /// View of the topic; 0 for messages about all views.
    pub view: usize,
    /// Current time, `CLOCK_MONOTONIC`, in nanoseconds.
    pub now_nanos: u64,
}

impl Expected {
    /// Checks that a message is from this session and from the sender of the topic, and has no time in the
    /// future.
    ///
    /// # Errors
    ///
    /// Returns [`WireError::Session`], [`WireError::Sender`], or an error of [`Self::check_time`].
    pub fn check(&self, stamp: &Stamp, timing: &Timing) -> Result<(), WireError> {
        self.check_session(stamp)?;
        if stamp.view as usize != self.view {
            return Err(WireError::Sender {
                field: "view",
                got: stamp.view as usize,
                expected: self.view,
            });
        }
        self.check_time(stamp, timing)
    }

    /// Checks that the result of a pair is from this session and from the worker of the pair, and has no time
    /// in the future. `view` is the index of the worker.
    ///
    /// * `n_workers`: number of workers. The pairs are assigned to them in turn.
    ///
    /// # Errors
    ///
    /// Returns [`WireError::Session`], [`WireError::Sender`], or an error of [`Self::check_time`].
    pub fn check_pair(
        &self,
        stamp: &Stamp,
        timing: &Timing,
        n_workers: usize,
    ) -> Result<(), WireError> {
        self.check_session(stamp)?;
        if stamp.view as usize % n_workers.max(1) != self.view {
            return Err(WireError::Sender {
                field: "pair",
                got: stamp.view as usize,
                expected: self.view,
            });
        }
        self.check_time(stamp, timing)
    }

    /// Checks that a message without a view is from this session, and has no time in the future.
    ///
    /// # Errors
    ///
    /// Returns [`WireError::Session`] or an error of [`Self::check_time`].
    pub fn check_end(&self, stamp: &Stamp, timing: &Timing) -> Result<(), WireError> {
        self.check_session(stamp)?;
        self.check_time(stamp, timing)
    }

    fn check_session(&self, stamp: &Stamp) -> Result<(), WireError> {
        if stamp.session == self.session {
            return Ok(());
        }
        Err(WireError::Session {
            got: stamp.session,
            expected: self.session,
        })
    }

    /// Checks that a message has no time in the future.
    ///
    /// # Errors
    ///
    /// Returns [`WireError::Future`] if a time is more than a second ahead, or [`WireError::Frame`] if the frame number
    /// is too large.
    pub fn check_time(&self, stamp: &Stamp, timing: &Timing) -> Result<(), WireError> {
        for (field, nanos) in [
            ("captured_at", stamp.captured_at_nanos),
            ("received_at", timing.received_at_nanos),
            ("sent_at", timing.sent_at_nanos),
        ] {
            let ahead_nanos = nanos.saturating_sub(self.now_nanos);
            if ahead_nanos > SLACK_NANOS {
                return Err(WireError::Future { field, ahead_nanos });
            }
        }
        at_most("frame", stamp.frame, MOST_FRAMES)
    }
}

/// Checks a frame against its pixels. A frame without an image may have any number of pixels.
///
/// * `n_bytes`: number of bytes of the received pixels.
///
/// # Errors
///
/// Returns a [`WireError`] if the pixels do not fill the image, if the number of dropped frames is too large, or if
/// [`Expected::check`] fails.
pub fn check_frame(
    header: &FrameHeader,
    n_bytes: usize,
    expected: &Expected,
) -> Result<(), WireError> {
    expected.check(&header.stamp, &header.timing)?;
    at_most("n_dropped", header.n_dropped, MOST_FRAMES)?;
    if header.status != Status::OK {
        return Ok(());
    }
    let [width, height] = [header.width as usize, header.height as usize];
    equal(
        "bytes",
        n_bytes,
        width.saturating_mul(height).saturating_mul(3),
    )
}

pub(crate) fn at_most(field: &'static str, got: u64, limit: u64) -> Result<(), WireError> {
    if got > limit {
        return Err(WireError::Frame { field, got, limit });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use messages::Refusal;
    use proptest::prelude::*;

    use super::*;

    const EXPECTED: Expected = Expected {
        session: 7,
        view: 2,
        now_nanos: 5_000_000_000,
    };

    fn stamp() -> Stamp {
        Stamp {
            session: 7,
            frame: 9,
            captured_at_nanos: 4_900_000_000,
            view: 2,
            epoch: 1,
        }
    }

    fn timing() -> Timing {
        Timing {
            received_at_nanos: 4_950_000_000,
            sent_at_nanos: 5_000_000_001,
        }
    }

    fn header() -> FrameHeader {
        FrameHeader {
            stamp: stamp(),
            timing: timing(),
            width: 4,
            height: 3,
            n_dropped: 9,
            ..FrameHeader::default()
        }
    }

    /// Returns the error for a frame of 36 bytes whose header was changed.
    fn refused(change: impl Fn(&mut FrameHeader)) -> (Refusal, String) {
        let mut header = header();
        check_frame(&header, 36, &EXPECTED).unwrap();
        change(&mut header);
        let error = check_frame(&header, 36, &EXPECTED).unwrap_err();
        (error.refusal(), error.to_string())
    }

    #[test]
    fn messages_of_another_session_or_view_are_refused() {
        let (cause, text) = refused(|header| header.stamp.session = 8);
        assert_eq!(cause, Refusal::Session);
        assert_eq!(text, "session is 8, expected 7");
        let (cause, text) = refused(|header| header.stamp.view = u32::MAX);
        assert_eq!(cause, Refusal::Sender);
        assert_eq!(
            text,
            "view is 4294967295, but the sender of this topic must be 2"
        );
    }

    #[test]
    fn times_in_the_future_are_refused() {
        let (cause, text) = refused(|header| header.stamp.captured_at_nanos = 6_500_000_000);
        assert_eq!(cause, Refusal::Time);
        assert_eq!(text, "captured_at is 1500 ms ahead of the clock");
        assert_eq!(
            refused(|header| header.timing.sent_at_nanos = u64::MAX).0,
            Refusal::Time
        );
        assert_eq!(
            refused(|header| header.timing.received_at_nanos = u64::MAX).0,
            Refusal::Time
        );
        assert_eq!(
            refused(|header| header.stamp.frame = u64::MAX).0,
            Refusal::Time
        );
        let mut soon = header();
        soon.stamp.captured_at_nanos = 6_000_000_000;
        check_frame(&soon, 36, &EXPECTED).unwrap();
    }

    #[test]
    fn pixels_that_do_not_fill_their_image_are_refused() {
        assert_eq!(refused(|header| header.width = 5).0, Refusal::Size);
        let (cause, text) = refused(|header| (header.width, header.height) = (u32::MAX, u32::MAX));
        assert_eq!(cause, Refusal::Size);
        assert_eq!(text, format!("bytes is 36, expected {}", usize::MAX));
        let mut empty = header();
        empty.status = Status::NO_FRAME;
        check_frame(&empty, 1, &EXPECTED).unwrap();
    }

    #[test]
    fn too_many_dropped_frames_are_refused() {
        assert_eq!(
            refused(|header| header.n_dropped = u64::MAX).0,
            Refusal::Time
        );
    }

    #[test]
    fn results_of_pairs_that_belong_to_another_worker_are_refused() {
        for pair in [2, 5, 8] {
            let stamp = Stamp {
                view: pair,
                ..stamp()
            };
            EXPECTED.check_pair(&stamp, &timing(), 3).unwrap();
            let error = EXPECTED.check_pair(&stamp, &timing(), 2).unwrap_err();
            assert_eq!(error.refusal(), Refusal::Sender);
        }
    }

    /// Most times are near the present.
    fn any_time() -> impl Strategy<Value = u64> {
        prop_oneof![9 => 0_u64..7_000_000_000, 1 => any::<u64>()]
    }

    proptest! {
        #[test]
        fn any_message_is_refused_or_has_a_valid_time(
            frame in prop_oneof![4 => 0..MOST_FRAMES + 9, 1 => any::<u64>()],
            [captured_at_nanos, received_at_nanos, sent_at_nanos] in prop::array::uniform3(any_time()),
        ) {
            let stamp = Stamp { frame, captured_at_nanos, ..stamp() };
            let timing = Timing { received_at_nanos, sent_at_nanos };
            if EXPECTED.check(&stamp, &timing).is_ok() {
                let latest = EXPECTED.now_nanos + SLACK_NANOS;
                prop_assert!(stamp.frame <= MOST_FRAMES);
                prop_assert!(stamp.captured_at_nanos <= latest);
                prop_assert!(timing.sent_at_nanos.max(timing.received_at_nanos) <= latest);
            }
        }
    }
}
