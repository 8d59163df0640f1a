//! Which frame of the run a message from another host is for, and what became of the frames without one.

use messages::Status;

/// How far beyond the middle between two instants a message keeps to the one that is next, in periods: clocks that are as far
/// apart would else change between two.
const SLACK: f64 = 0.1;

/// The instants of the run: `start + nth * period`, by our clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The first instant, nanoseconds.
    pub start_nanos: u64,
    /// From one to the next, nanoseconds.
    pub period_nanos: f64,
}

impl Grid {
    /// When an instant is, nanoseconds.
    pub fn at(&self, nth: u64) -> u64 {
        self.start_nanos.saturating_add((nth as f64 * self.period_nanos).round() as u64)
    }

    /// The latest instant that is not after a time; 0 before all.
    pub fn latest(&self, nanos: u64) -> u64 {
        self.exact(nanos).max(0.0) as u64
    }

    fn exact(&self, nanos: u64) -> f64 {
        (i128::from(nanos) - i128::from(self.start_nanos)) as f64 / self.period_nanos
    }
}

/// Why there is no message for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gap {
    /// It did not come in time, though its host is there.
    Late,
    /// Its host did not answer.
    Gone,
    /// A newer one came before it: the link or the camera's process had no time for it.
    LeftOut,
}

impl Gap {
    /// Status that is published in place of the message.
    pub fn status(self) -> Status {
        match self {
            Self::Late => Status::LATE,
            Self::Gone => Status::HOST_GONE,
            Self::LeftOut => Status::LEFT_OUT,
        }
    }
}

/// Where a message belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// To this frame. Those from [`Arrivals::next`] to it have none.
    Frame(u64),
    /// To one that was given up.
    Late,
    /// To none: there is one for this frame, or it is before or beyond all.
    Surplus,
}

/// Counts of the frames and messages of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Frames with a message.
    pub n_used: u64,
    /// Frames given up while their host was there.
    pub n_late: u64,
    /// Frames given up because their host did not answer.
    pub n_gone: u64,
    /// Frames that a newer one came before.
    pub n_left_out: u64,
    /// Messages that came after their frame was given up; their frames are among the above.
    pub n_came_late: u64,
    /// Messages for which there was no frame.
    pub n_surplus: u64,
}

/// The messages of one view. Reads no clock.
#[derive(Debug, Clone)]
pub struct Arrivals {
    grid: Grid,
    /// How long after its instant a frame is given up, nanoseconds: where its host is there, and where it is not.
    patience: [u64; 2],
    n_frames: u64,
    next: u64,
    tally: Tally,
}

impl Arrivals {
    /// * `patience`: how long after its instant a frame is given up, nanoseconds: where its host is there, and where it is not.
    /// * `n_frames`: of the run.
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

    /// The first frame that has not been published.
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

    /// Where a message belongs.
    ///
    /// * `instant_nanos`: the instant that its host gave it, by our clock.
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
        // The frame before the next one is either given up, or has its message: clocks of different rates.
        if self.given_up() > 0 {
            self.tally.n_came_late += 1;
            Place::Late
        } else {
            self.tally.n_surplus += 1;
            Place::Surplus
        }
    }

    /// The frame whose instant is nearest; 0 before all.
    pub fn nearest(&self, instant_nanos: u64) -> u64 {
        self.grid.exact(instant_nanos).round().max(0.0) as u64
    }

    fn given_up(&self) -> u64 {
        self.tally.n_late + self.tally.n_gone
    }

    /// A frame was published with its message.
    pub fn used(&mut self) {
        self.tally.n_used += 1;
        self.next += 1;
    }

    /// A frame was published without one.
    pub fn gave_up(&mut self, gap: Gap) {
        match gap {
            Gap::Late => self.tally.n_late += 1,
            Gap::Gone => self.tally.n_gone += 1,
            Gap::LeftOut => self.tally.n_left_out += 1,
        }
        self.next += 1;
    }

    /// Why the next frame is given up, if it is time for that.
    ///
    /// * `is_there`: whether its host answers.
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

    /// When the next frame is given up, by our clock, nanoseconds.
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
    fn every_message_has_its_frame_and_those_between_are_left_out() {
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
    fn a_frame_is_given_up_after_a_while_and_its_message_is_late() {
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
    fn clocks_that_jitter_about_the_middle_keep_to_their_frames() {
        let mut it = arrivals();
        for nth in 0..100 {
            let jitter = if nth % 2 == 0 { 45 } else { 55 };
            assert_eq!(it.place(GRID.at(nth) + jitter), Place::Frame(nth));
            it.used();
        }
    }

    #[test]
    fn before_and_beyond_the_run_nothing_has_a_place() {
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
        fn every_frame_is_published_once_whatever_comes(
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
