//! Assigns messages from another host to frames of the run, and counts the frames without a message.

use messages::Status;

/// Tolerance beyond the midpoint between two frame times, in periods. Within it, a message still belongs to the frame that is due next.
/// Without it, messages would alternate between two frames if two clocks differ by half a period.
const SLACK: f64 = 0.1;

/// The frame times of the run: `start + nth * period`, by this host's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Time of the first frame, in nanoseconds.
    pub start_nanos: u64,
    /// Interval between the nominal times of consecutive frames, in nanoseconds.
    pub period_nanos: f64,
}

impl Grid {
    /// Returns the nominal time of a frame, in nanoseconds.
    pub fn at(&self, nth: u64) -> u64 {
        self.start_nanos.saturating_add((nth as f64 * self.period_nanos).round() as u64)
    }

    /// Returns the index of the last frame whose nominal time is not after the given time; 0 if no such frame exists.
    pub fn latest(&self, nanos: u64) -> u64 {
        self.exact(nanos).max(0.0) as u64
    }

    fn exact(&self, nanos: u64) -> f64 {
        (i128::from(nanos) - i128::from(self.start_nanos)) as f64 / self.period_nanos
    }
}

/// Reason why there is no message for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gap {
    /// The message did not arrive in time, although its host answers.
    Late,
    /// The host did not answer.
    Gone,
    /// A newer message arrived first: the link or the camera's process was too busy to send this message.
    LeftOut,
}

impl Gap {
    /// Returns the status that is published in place of the message.
    pub fn status(self) -> Status {
        match self {
            Self::Late => Status::LATE,
            Self::Gone => Status::HOST_GONE,
            Self::LeftOut => Status::LEFT_OUT,
        }
    }
}

/// Frame to which a message belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The message belongs to this frame. Frames from [`Arrivals::next`] up to it have no message.
    Frame(u64),
    /// The message belongs to a frame that was given up.
    Late,
    /// The message belongs to no frame: its frame already has a message, or its time is before the first frame or after the last.
    Surplus,
}

/// Counts of the frames and messages of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Number of frames with a message.
    pub n_used: u64,
    /// Number of frames given up although their host answers.
    pub n_late: u64,
    /// Number of frames given up because their host did not answer.
    pub n_gone: u64,
    /// Number of frames without a message because a newer message arrived first.
    pub n_left_out: u64,
    /// Number of messages that arrived after their frame was given up. These frames are included in the counts above.
    pub n_came_late: u64,
    /// Number of messages without a frame.
    pub n_surplus: u64,
}

/// The messages of one view. The caller passes the time, so no clock is read.
#[derive(Debug, Clone)]
pub struct Arrivals {
    grid: Grid,
    /// Time after its nominal time at which a frame is given up, in nanoseconds: the first value if its host answers, the second if not.
    patience: [u64; 2],
    n_frames: u64,
    next: u64,
    tally: Tally,
}

impl Arrivals {
    /// Creates the state of a view.
    ///
    /// * `patience`: time after its nominal time at which a frame is given up, in nanoseconds: the first value if its host answers, the
    ///   second if not.
    /// * `n_frames`: number of frames of the run.
    /// * `next`: the first frame that has not been published.
    pub fn new(grid: Grid, patience: [u64; 2], n_frames: u64, next: u64) -> Self {
        Self {
            grid,
            patience,
            n_frames,
            next,
            tally: Tally::default(),
        }
    }

    /// Returns the first frame that has not been published.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Returns true if every frame of the run has been published.
    pub fn is_over(&self) -> bool {
        self.next >= self.n_frames
    }

    /// Returns the counts of the frames so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Returns the frame to which a message belongs.
    ///
    /// * `instant_nanos`: the frame time that the sending host assigned, converted to this host's clock.
    pub fn place(&mut self, instant_nanos: u64) -> Place {
        let exact = self.grid.exact(instant_nanos);
        let nth = if (exact - self.next as f64).abs() <= 0.5 + SLACK {
            self.next as f64
        } else {
            exact.round()
        };
        if nth < 0.0 || nth >= self.n_frames as f64 {
            self.tally.n_surplus += 1;
            return Place::Surplus;
        }
        let nth = nth as u64;
        if nth >= self.next {
            return Place::Frame(nth);
        }
        // The previous frame was given up, or it already has its message because the clocks have different rates.
        if self.given_up() > 0 {
            self.tally.n_came_late += 1;
            Place::Late
        } else {
            self.tally.n_surplus += 1;
            Place::Surplus
        }
    }

    /// Returns the frame whose nominal time is nearest; 0 before the first frame.
    pub fn nearest(&self, instant_nanos: u64) -> u64 {
        self.grid.exact(instant_nanos).round().max(0.0) as u64
    }

    fn given_up(&self) -> u64 {
        self.tally.n_late + self.tally.n_gone
    }

    /// Records that a frame was published with its message.
    pub fn used(&mut self) {
        self.tally.n_used += 1;
        self.next += 1;
    }

    /// Records that a frame was published without a message.
    pub fn gave_up(&mut self, gap: Gap) {
        match gap {
            Gap::Late => self.tally.n_late += 1,
            Gap::Gone => self.tally.n_gone += 1,
            Gap::LeftOut => self.tally.n_left_out += 1,
        }
        self.next += 1;
    }

    /// Returns the reason to give up the next frame, if its message is overdue.
    ///
    /// * `is_there`: true if its host answers.
    pub fn overdue(&self, now_nanos: u64, is_there: bool) -> Option<Gap> {
        let [patience, gap] = if is_there {
            [self.patience[0], 0]
        } else {
            [self.patience[1], 1]
        };
        let is_due =
            !self.is_over() && now_nanos > self.grid.at(self.next).saturating_add(patience);
        is_due.then_some(if gap == 0 { Gap::Late } else { Gap::Gone })
    }

    /// Returns the time at which the next frame is given up, by this host's clock, in nanoseconds.
    pub fn due_nanos(&self, is_there: bool) -> u64 {
        let patience = self.patience[usize::from(!is_there)];
        self.grid.at(self.next).saturating_add(patience)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const GRID: Grid = Grid {
        start_nanos: 1_000_000,
        period_nanos: 100.0,
    };

    fn arrivals() -> Arrivals {
        Arrivals::new(GRID, [300, 100], 1000, 0)
    }

    #[test]
    fn each_message_is_assigned_to_its_frame_and_surplus_messages_are_left_out() {
        let mut it = arrivals();
        assert_eq!(it.place(GRID.at(0)), Place::Frame(0));
        it.used();
        assert_eq!(it.place(GRID.at(3)), Place::Frame(3));
        while it.next() < 3 {
            it.gave_up(Gap::LeftOut);
        }
        it.used();
        let tally = it.tally();
        assert_eq!((tally.n_used, tally.n_left_out, it.next()), (2, 2, 4));
    }

    #[test]
    fn a_frame_is_skipped_after_a_timeout_and_its_later_message_counts_as_late() {
        let mut it = arrivals();
        assert_eq!(it.overdue(GRID.at(0) + 300, true), None);
        assert_eq!(it.overdue(GRID.at(0) + 301, true), Some(Gap::Late));
        assert_eq!(it.overdue(GRID.at(0) + 101, false), Some(Gap::Gone));
        it.gave_up(Gap::Late);
        it.gave_up(Gap::Gone);
        assert_eq!(it.place(GRID.at(0)), Place::Late);
        assert_eq!(it.place(GRID.at(2)), Place::Frame(2));
        assert_eq!(it.tally().n_came_late, 1);
    }

    #[test]
    fn capture_times_that_jitter_around_the_middle_between_two_frames_keep_their_frames() {
        let mut it = arrivals();
        for nth in 0..100 {
            let jitter = if nth % 2 == 0 { 45 } else { 55 };
            assert_eq!(it.place(GRID.at(nth) + jitter), Place::Frame(nth));
            it.used();
        }
    }

    #[test]
    fn messages_before_the_start_and_after_the_end_of_the_run_are_surplus() {
        let mut it = arrivals();
        assert_eq!(it.place(0), Place::Surplus);
        assert_eq!(it.place(GRID.at(1000)), Place::Surplus);
        assert_eq!(it.place(u64::MAX), Place::Surplus);
        assert!(!it.is_over());
        let mut over = Arrivals::new(GRID, [300, 100], 2, 2);
        assert!(over.is_over());
        assert_eq!(over.overdue(u64::MAX, true), None);
        assert_eq!(over.place(GRID.at(1)), Place::Surplus);
    }

    proptest! {
        #[test]
        fn every_frame_is_published_once_for_any_sequence_of_arrivals(
            steps in prop::collection::vec((0_u64..200_000, any::<bool>(), any::<bool>()), 1..300),
        ) {
            let mut it = arrivals();
            for (time, is_there, is_message) in steps {
                if is_message {
                    if let Place::Frame(nth) = it.place(GRID.start_nanos + time) {
                        while it.next() < nth {
                            it.gave_up(Gap::LeftOut);
                        }
                        it.used();
                    }
                } else if let Some(gap) = it.overdue(GRID.start_nanos + time, is_there) {
                    it.gave_up(gap);
                }
                let tally = it.tally();
                let all = tally.n_used + tally.n_late + tally.n_gone + tally.n_left_out;
                prop_assert_eq!(all, it.next());
                prop_assert!(it.next() <= 1000);
            }
        }
    }
}
