//! Converts the times of a recording to the times of the run in which it is replayed.

use messages::{Stamp, Timing};
use recording::Envelope;

/// Speed of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// The highest speed at which messages can be read and received.
    Max,
    /// A multiple of the recorded speed, above 0.
    Times(f64),
}

/// Relation between the clock of the recording and the clock of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    /// Send time of the first message, by the clock of the recording, in nanoseconds.
    pub recorded: u64,
    /// Time from the first message to the last, in nanoseconds.
    pub length: u64,
    /// Time at which the run was planned, by this machine's clock, in nanoseconds.
    pub planned: u64,
    /// Replay speed.
    pub pace: Pace,
}

/// Time from the planning of the run to the first message, if a replay speed is given.
const LEAD_NANOS: u64 = 2_000_000_000;

impl Clock {
    /// Returns the time at which the first message is sent, by this machine's clock, if a replay speed is given.
    fn begin(&self) -> u64 {
        self.planned.saturating_add(LEAD_NANOS)
    }

    /// Returns the time at which a message is due, by this machine's clock; 0 at [`Pace::Max`].
    ///
    /// * `sent_at`: send time by the clock of the recording.
    pub(crate) fn due(&self, sent_at: u64) -> u64 {
        match self.pace {
            Pace::Max => 0,
            Pace::Times(times) => {
                let since = sent_at.saturating_sub(self.recorded) as f64 / times;
                // The conversion saturates, and turns NaN into 0.
                self.begin().saturating_add(since as u64)
            }
        }
    }

    /// Returns the envelope of a message in this run.
    ///
    /// All capture times are shifted by the same amount, so the times between frames stay the same. The shift is chosen so
    /// that no message is sent before its frame was captured, even if the replay is faster than the recording. The send
    /// time is `now`. The computing time is not changed.
    ///
    /// * `session`: session of this run.
    /// * `epoch`: number of restarts of this process, which is added to the recorded epoch.
    /// * `now`: time by this machine's clock, in nanoseconds.
    pub(crate) fn rebase(&self, recorded: &Envelope, [session, epoch, now]: [u64; 3]) -> Envelope {
        let timing = recorded.timing;
        let computing = timing.sent_at_nanos.saturating_sub(timing.received_at_nanos);
        Envelope {
            stamp: Stamp {
                session,
                captured_at_nanos: self.shifted(recorded.stamp.captured_at_nanos),
                epoch: recorded.stamp.epoch.saturating_add(epoch as u32),
                ..recorded.stamp
            },
            timing: Timing {
                received_at_nanos: now.saturating_sub(computing),
                sent_at_nanos: now,
            },
            status: recorded.status,
        }
    }

    fn shifted(&self, time: u64) -> u64 {
        let (first, ahead) = match self.pace {
            Pace::Max => (self.planned, self.length),
            Pace::Times(times) if times > 1.0 => {
                let replayed = (self.length as f64 / times) as u64;
                (self.begin(), self.length.saturating_sub(replayed))
            }
            Pace::Times(_) => (self.begin(), 0),
        };
        let first = i128::from(first) - i128::from(ahead);
        let shifted = i128::from(time) - i128::from(self.recorded) + first;
        u64::try_from(shifted.max(0)).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use messages::Status;
    use proptest::prelude::*;

    use super::*;

    fn clock(pace: Pace) -> Clock {
        Clock {
            recorded: 1000,
            length: 500,
            planned: 50_000,
            pace,
        }
    }

    #[test]
    fn at_double_speed_messages_are_sent_in_half_the_time() {
        let due = |pace| clock(pace).due(1400);
        let first = 50_000 + LEAD_NANOS;
        assert_eq!(due(Pace::Times(1.0)), first + 400);
        assert_eq!(due(Pace::Times(2.0)), first + 200);
        assert_eq!(due(Pace::Times(0.5)), first + 800);
        assert_eq!(due(Pace::Max), 0);
        assert_eq!(clock(Pace::Times(1e-300)).due(u64::MAX), u64::MAX);
    }

    fn envelope(captured_at_nanos: u64, timing: [u64; 2]) -> Envelope {
        let stamp = Stamp {
            session: 1,
            frame: 9,
            captured_at_nanos,
            view: 2,
            epoch: 3,
        };
        Envelope {
            stamp,
            timing: Timing {
                received_at_nanos: timing[0],
                sent_at_nanos: timing[1],
            },
            status: Status::NO_DETECTION,
        }
    }

    #[test]
    fn a_replayed_message_has_the_session_and_send_time_of_this_run_and_its_own_computing_time() {
        let got = clock(Pace::Max).rebase(&envelope(990, [1100, 1130]), [7, 1, 80_000]);
        let mut expected = envelope(49_490, [79_970, 80_000]);
        (expected.stamp.session, expected.stamp.epoch) = (7, 4);
        assert_eq!(got, expected);
    }

    proptest! {
        #[test]
        fn the_time_between_two_frames_is_unchanged(
            [first, second] in prop::array::uniform2(0_u64..1 << 60), pace in 0.1..10.0,
        ) {
            let clock = Clock { recorded: 0, length: 1 << 60, planned: 1 << 61, pace: Pace::Times(pace) };
            let captured = |time| clock.rebase(&envelope(time, [0, 0]), [0; 3]).stamp.captured_at_nanos;
            prop_assert_eq!(captured(first).abs_diff(captured(second)), first.abs_diff(second));
        }

        #[test]
        fn no_message_is_sent_before_its_frame_was_captured(
            at in 0_u64..1 << 40, ago in 0_u64..1 << 30, pace in prop_oneof![
                Just(Pace::Max), (0.1..10.0).prop_map(Pace::Times)
            ],
        ) {
            let (recorded, length, planned) = (1 << 35, 1 << 40, 1 << 50);
            let clock = Clock { recorded, length, planned, pace };
            let sent_at = recorded + at;
            let captured = clock.rebase(&envelope(sent_at - ago, [0, 0]), [0; 3]).stamp;
            // A float near 2^40 is exact to less than a microsecond.
            let sent_now = clock.due(sent_at).max(planned);
            prop_assert!(captured.captured_at_nanos <= sent_now + 1000);
        }

        #[test]
        fn any_times_are_accepted(
            [recorded, length, now]: [u64; 3], time: u64, timing: [u64; 2], pace in 1e-9..1e9,
        ) {
            let clock = Clock { recorded, length, planned: now, pace: Pace::Times(pace) };
            clock.due(time);
            clock.rebase(&envelope(time, timing), [0, u64::MAX, now]);
        }
    }
}
