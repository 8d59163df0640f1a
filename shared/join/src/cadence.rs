//! Which frames a stage takes that cannot keep up, so that all stages take the same.

/// Answers that must take too long, or be quick, in a row before another cadence is chosen.
const N_SLOW: u32 = 3;
const N_QUICK: u32 = 8;
/// Share of the time to the next frame that an answer may take if twice as many are to be taken.
const IDLE: f64 = 0.7;
/// Most frames from one that is taken to the next.
const MOST: u64 = 1 << 16;

/// Finds out how many frames to pass over where the latest one wins.
///
/// Stages that each take whatever is newest when they are free take different frames, and what they
/// say cannot be joined. So a stage takes every n-th frame only, with n a power of two that follows
/// from how long its answers take: the frames of the slowest are then among those of all others, and
/// nobody has to be asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Cadence {
    stride: u64,
    n_slow: u32,
    n_quick: u32,
    /// The frame before, and when it was captured.
    last: Option<(u64, u64)>,
}

impl Default for Cadence {
    fn default() -> Self {
        Self {
            stride: 1,
            n_slow: 0,
            n_quick: 0,
            last: None,
        }
    }
}

impl Cadence {
    /// Whether a frame is one of those that are taken.
    ///
    /// * `nth`: its number among the frames in use, the same in all stages.
    pub fn takes(&self, nth: u64) -> bool {
        nth.is_multiple_of(self.stride)
    }

    /// Frames from one that is taken to the next.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Notes that a frame was answered.
    ///
    /// * `captured_at_nanos`: from which the time between frames follows.
    /// * `busy_nanos`: how long the answer took.
    pub fn answered(&mut self, nth: u64, captured_at_nanos: u64, busy_nanos: u64) {
        let last = self.last.replace((nth, captured_at_nanos));
        let Some((frames, nanos)) = last.and_then(|(frame, at)| {
            let frames = nth.checked_sub(frame).filter(|it| *it > 0)?;
            Some((frames, captured_at_nanos.saturating_sub(at).max(1)))
        }) else {
            return;
        };
        let period = nanos as f64 / frames as f64;
        let needed = busy_nanos as f64 / period;
        self.n_slow = if needed > self.stride as f64 {
            self.n_slow + 1
        } else {
            0
        };
        self.n_quick = if needed < IDLE * (self.stride / 2) as f64 {
            self.n_quick + 1
        } else {
            0
        };
        if self.n_slow >= N_SLOW {
            let least = needed.ceil().min(MOST as f64) as u64;
            self.stride = least.next_power_of_two().max(self.stride);
            self.n_slow = 0;
        } else if self.n_quick >= N_QUICK {
            self.stride /= 2;
            self.n_quick = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Frames 100 ns apart, each of which takes so long to answer; the frames that are taken.
    fn taken(cadence: &mut Cadence, frames: core::ops::Range<u64>, busy: u64) -> Vec<u64> {
        let mut free_at = 0;
        let mut taken = Vec::new();
        for nth in frames {
            let now = nth * 100;
            if now >= free_at && cadence.takes(nth) {
                free_at = now + busy;
                cadence.answered(nth, now, busy);
                taken.push(nth);
            }
        }
        taken
    }

    #[test]
    fn who_keeps_up_takes_every_frame() {
        let mut cadence = Cadence::default();
        assert_eq!(taken(&mut cadence, 0..50, 80), (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn who_is_slow_takes_every_nth_frame_with_n_a_power_of_two() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 250);
        assert_eq!(cadence.stride(), 4);
        assert_eq!(taken(&mut cadence, 20..40, 250), [20, 24, 28, 32, 36]);
    }

    #[test]
    fn one_slow_answer_changes_nothing() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..5, 50);
        taken(&mut cadence, 5..6, 700);
        taken(&mut cadence, 12..20, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn who_becomes_quick_takes_more_frames_again() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 350);
        assert_eq!(cadence.stride(), 4);
        taken(&mut cadence, 20..400, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn who_would_hardly_keep_up_with_more_frames_stays() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 105);
        assert_eq!(cadence.stride(), 2);
        taken(&mut cadence, 20..400, 80);
        assert_eq!(cadence.stride(), 2);
    }

    #[test]
    fn numbers_that_go_nowhere_do_no_harm() {
        let mut cadence = Cadence::default();
        for (nth, at, busy) in [
            (5, 9, 9),
            (5, 9, 9),
            (3, 1, u64::MAX),
            (u64::MAX, 0, u64::MAX),
        ] {
            cadence.answered(nth, at, busy);
        }
        cadence.answered(0, u64::MAX, 0);
        assert!(cadence.stride() <= MOST);
    }

    proptest! {
        #[test]
        fn the_frames_of_the_slower_are_among_those_of_the_faster(
            busy in prop::array::uniform2(1_u64..5000),
        ) {
            let [mut one, mut other] = [Cadence::default(), Cadence::default()];
            taken(&mut one, 0..2000, busy[0]);
            taken(&mut other, 0..2000, busy[1]);
            let (fast, slow) = if one.stride() < other.stride() { (one, other) } else { (other, one) };
            prop_assert!((0..500).all(|nth| !slow.takes(nth) || fast.takes(nth)));
        }
    }
}
