//! Chooses which frames a stage processes if it cannot process all of them, so that all stages choose the same frames.

/// Number of consecutive frames that must be too slow, or fast, before the stride changes.
const N_SLOW: u32 = 3;
const N_FAST: u32 = 8;
/// Maximum fraction of the available time that processing may take for the stride to be halved.
const HALVING_LOAD: f64 = 0.7;
/// Maximum stride.
const MAX_STRIDE: u64 = 1 << 16;

/// Decides which frames a stage skips with realtime delivery.
///
/// If every stage processed the newest frame whenever it is idle, stages would process different frames, and their messages could not be
/// joined. A stage therefore processes only every n-th frame, where n is a power of two that depends on the measured processing time. All
/// other stages then process the frames of the slowest stage as well, without any communication between stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Cadence {
    stride: u64,
    n_slow: u32,
    n_fast: u32,
    /// The last processed frame, and its capture time.
    last: Option<(u64, u64)>,
}

impl Default for Cadence {
    fn default() -> Self {
        Self {
            stride: 1,
            n_slow: 0,
            n_fast: 0,
            last: None,
        }
    }
}

impl Cadence {
    /// Returns true if a frame has to be processed.
    ///
    /// * `nth`: position of the frame among the used frames of the deployment; the same in all stages.
    pub fn takes(&self, nth: u64) -> bool {
        nth.is_multiple_of(self.stride)
    }

    /// Returns the distance between processed frames.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Records that a frame was processed.
    ///
    /// * `captured_at_nanos`: capture time, from which the time between frames is computed.
    /// * `busy_nanos`: the processing time.
    pub fn processed(&mut self, nth: u64, captured_at_nanos: u64, busy_nanos: u64) {
        let last = self.last.replace((nth, captured_at_nanos));
        let Some((frames, nanos)) = last.and_then(|(frame, at)| {
            let frames = nth.checked_sub(frame).filter(|n| *n > 0)?;
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
        self.n_fast = if needed < HALVING_LOAD * (self.stride / 2) as f64 {
            self.n_fast + 1
        } else {
            0
        };
        if self.n_slow >= N_SLOW {
            let smallest = needed.ceil().min(MAX_STRIDE as f64) as u64;
            self.stride = smallest.next_power_of_two().max(self.stride);
            self.n_slow = 0;
        } else if self.n_fast >= N_FAST {
            self.stride /= 2;
            self.n_fast = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the frames that are processed if frames are 100 ns apart and each takes `busy` ns.
    fn taken(cadence: &mut Cadence, frames: core::ops::Range<u64>, busy: u64) -> Vec<u64> {
        let mut free_at = 0;
        let mut taken = Vec::new();
        for nth in frames {
            let now = nth * 100;
            if now >= free_at && cadence.takes(nth) {
                free_at = now + busy;
                cadence.processed(nth, now, busy);
                taken.push(nth);
            }
        }
        taken
    }

    #[test]
    fn a_fast_stage_takes_every_frame() {
        let mut cadence = Cadence::default();
        assert_eq!(taken(&mut cadence, 0..50, 80), (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn a_slow_stage_takes_every_nth_frame_with_n_a_power_of_two() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 250);
        assert_eq!(cadence.stride(), 4);
        assert_eq!(taken(&mut cadence, 20..40, 250), [20, 24, 28, 32, 36]);
    }

    #[test]
    fn one_slow_frame_does_not_change_the_stride() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..5, 50);
        taken(&mut cadence, 5..6, 700);
        taken(&mut cadence, 12..20, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn a_stage_that_becomes_faster_takes_more_frames_again() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 350);
        assert_eq!(cadence.stride(), 4);
        taken(&mut cadence, 20..400, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn the_stride_is_not_halved_without_a_margin() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 105);
        assert_eq!(cadence.stride(), 2);
        taken(&mut cadence, 20..400, 80);
        assert_eq!(cadence.stride(), 2);
    }

    #[test]
    fn numbers_out_of_order_or_range_are_tolerated() {
        let mut cadence = Cadence::default();
        for (nth, at, busy) in [
            (5, 9, 9),
            (5, 9, 9),
            (3, 1, u64::MAX),
            (u64::MAX, 0, u64::MAX),
        ] {
            cadence.processed(nth, at, busy);
        }
        cadence.processed(0, u64::MAX, 0);
        assert!(cadence.stride() <= MAX_STRIDE);
    }

    proptest! {
        #[test]
        fn the_frames_of_a_slower_stage_are_among_those_of_a_faster_one(
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
