//! Whether a message belongs to its topic, to this run and to this time.

use messages::{FrameHeader, Stamp, Status, Timing};

use crate::WireError;
use crate::error::equal;

/// How far a time stamp may be ahead: the clock is the same for all processes of a machine, so this is
/// ample.
const SLACK_NANOS: u64 = 1_000_000_000;
/// More frames than any camera takes in its life.
const MOST_FRAMES: u64 = 1 << 40;

/// What the receiver of a topic knows before a message comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// The run.
    pub session: u64,
    /// Whose topic it is: the view; 0 for what is about all views.
    pub view: usize,
    /// `CLOCK_MONOTONIC`, nanoseconds.
    pub now_nanos: u64,
}

impl Expected {
    /// Checks that a message is from this run and from whom the topic belongs to, and speaks of nothing
    /// that is still to come.
    ///
    /// # Errors
    ///
    /// [`WireError::Session`], [`WireError::Sender`], and as [`Self::check_time`].
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

    /// Checks that the answer of a pair is from this run, from a worker that has this pair, and speaks of
    /// nothing that is still to come. `view` is the worker.
    ///
    /// * `n_workers`: to whom the pairs are dealt in turn.
    ///
    /// # Errors
    ///
    /// [`WireError::Session`], [`WireError::Sender`], and as [`Self::check_time`].
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

    /// Checks that a message that names nobody is from this run, and speaks of nothing that is still to
    /// come.
    ///
    /// # Errors
    ///
    /// [`WireError::Session`], and as [`Self::check_time`].
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

    /// Checks that a message speaks of nothing that is still to come.
    ///
    /// # Errors
    ///
    /// [`WireError::Future`] if a time is more than a second ahead, [`WireError::Frame`] if the number of
    /// the frame is not one.
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

/// Checks a frame against its pixels; one without an image may have any.
///
/// * `n_bytes`: of the pixels that came.
///
/// # Errors
///
/// [`WireError`] if the pixels do not fill the image, if more frames were dropped than there can be, and
/// as [`Expected::check`].
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

fn at_most(field: &'static str, got: u64, limit: u64) -> Result<(), WireError> {
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

    /// Why a frame of 36 bytes that was changed is refused.
    fn refused(change: impl Fn(&mut FrameHeader)) -> (Refusal, String) {
        let mut header = header();
        check_frame(&header, 36, &EXPECTED).unwrap();
        change(&mut header);
        let error = check_frame(&header, 36, &EXPECTED).unwrap_err();
        (error.refusal(), error.to_string())
    }

    #[test]
    fn what_is_of_another_run_or_view_is_refused() {
        let (cause, said) = refused(|it| it.stamp.session = 8);
        assert_eq!(cause, Refusal::Session);
        assert_eq!(said, "session is 8, expected 7");
        let (cause, said) = refused(|it| it.stamp.view = u32::MAX);
        assert_eq!(cause, Refusal::Sender);
        assert_eq!(said, "view is 4294967295, but this is the topic of 2");
    }

    #[test]
    fn what_is_still_to_come_is_refused() {
        let (cause, said) = refused(|it| it.stamp.captured_at_nanos = 6_500_000_000);
        assert_eq!(cause, Refusal::Time);
        assert_eq!(said, "captured_at lies 1500 ms ahead of the clock");
        assert_eq!(
            refused(|it| it.timing.sent_at_nanos = u64::MAX).0,
            Refusal::Time
        );
        assert_eq!(
            refused(|it| it.timing.received_at_nanos = u64::MAX).0,
            Refusal::Time
        );
        assert_eq!(refused(|it| it.stamp.frame = u64::MAX).0, Refusal::Time);
        let mut soon = header();
        soon.stamp.captured_at_nanos = 6_000_000_000;
        check_frame(&soon, 36, &EXPECTED).unwrap();
    }

    #[test]
    fn pixels_that_do_not_fill_their_image_are_refused() {
        assert_eq!(refused(|it| it.width = 5).0, Refusal::Size);
        let (cause, said) = refused(|it| (it.width, it.height) = (u32::MAX, u32::MAX));
        assert_eq!(cause, Refusal::Size);
        assert_eq!(said, format!("bytes is 36, expected {}", usize::MAX));
        let mut empty = header();
        empty.status = Status::NO_FRAME;
        check_frame(&empty, 1, &EXPECTED).unwrap();
    }

    #[test]
    fn nobody_drops_more_frames_than_there_can_be() {
        assert_eq!(refused(|it| it.n_dropped = u64::MAX).0, Refusal::Time);
    }

    #[test]
    fn a_worker_speaks_of_its_own_pairs_only() {
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

    proptest! {
        #[test]
        fn whatever_arrives_is_refused_or_in_time(
            words in prop::array::uniform5(any::<u64>()),
            near in any::<bool>(),
        ) {
            let time = |nanos: u64| if near { nanos % 7_000_000_000 } else { nanos };
            let stamp = Stamp { frame: words[0], captured_at_nanos: time(words[1]), ..stamp() };
            let timing = Timing { received_at_nanos: time(words[2]), sent_at_nanos: time(words[3]) };
            if EXPECTED.check(&stamp, &timing).is_ok() {
                let latest = EXPECTED.now_nanos + SLACK_NANOS;
                prop_assert!(stamp.frame <= MOST_FRAMES);
                prop_assert!(stamp.captured_at_nanos <= latest);
                prop_assert!(timing.sent_at_nanos.max(timing.received_at_nanos) <= latest);
            }
        }
    }
}
