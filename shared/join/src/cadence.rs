//! Selects which frames a stage processes when it cannot keep up, such that all stages select the
//! same frames.

/// Number of slow, or quick, results in a row before the stride changes.
const N_SLOW: u32 = 3;
const N_QUICK: u32 = 8;
/// The stride is halved only if a result takes less than this share of the time that is then
/// available.
const IDLE: f64 = 0.7;
/// Largest stride.
const MOST: u64 = 1 << 16;

/// Chooses the stride of the processed frames in realtime delivery.
///
/// If every stage processed the newest frame whenever it is idle, the stages would process
/// different frames, and their results could not be joined. So a stage processes every n-th frame,
/// with n a power of two that follows from its processing time. The frames of the slowest stage are
/// then processed by all other stages too, without communication between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cadence {
    stride: u64,
    n_slow: u32,
    n_quick: u32,
    /// Number and capture time of the frame before, nanoseconds.
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
    /// Whether a frame is to be processed.
    ///
    /// * `nth`: its number among the frames in use, the same in all stages.
    pub fn takes(&self, nth: u64) -> bool {
        nth.is_multiple_of(self.stride)
    }

    /// The stride: number of frames from one processed frame to the next.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Records that a frame was processed, and adapts the stride.
    ///
    /// * `captured_at_nanos`: capture time, which gives the time between frames.
    /// * `busy_nanos`: processing time.
    pub fn answered(&mut self, nth: u64, captured_at_nanos: u64, busy_nanos: u64) {
        let last = self.last.replace((nth, captured_at_nanos));
        let Some((frames, nanos)) = last.and_then(|(frame, at)| {
            let frames = nth.checked_sub(frame).filter(|step| *step > 0)?;
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

    /// Simulates frames 100 ns apart with a fixed processing time, and returns the processed
    /// frames.
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
    fn a_fast_stage_processes_every_frame() {
        let mut cadence = Cadence::default();
        assert_eq!(taken(&mut cadence, 0..50, 80), (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn a_slow_stage_processes_every_nth_frame_with_n_a_power_of_two() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 250);
        assert_eq!(cadence.stride(), 4);
        assert_eq!(taken(&mut cadence, 20..40, 250), [20, 24, 28, 32, 36]);
    }

    #[test]
    fn one_slow_result_does_not_change_the_stride() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..5, 50);
        taken(&mut cadence, 5..6, 700);
        taken(&mut cadence, 12..20, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn a_stage_that_becomes_faster_processes_more_frames_again() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 350);
        assert_eq!(cadence.stride(), 4);
        taken(&mut cadence, 20..400, 50);
        assert_eq!(cadence.stride(), 1);
    }

    #[test]
    fn the_stride_stays_if_the_stage_could_barely_process_twice_as_many_frames() {
        let mut cadence = Cadence::default();
        taken(&mut cadence, 0..20, 105);
        assert_eq!(cadence.stride(), 2);
        taken(&mut cadence, 20..400, 80);
        assert_eq!(cadence.stride(), 2);
    }

    #[test]
    fn invalid_frame_numbers_and_times_keep_the_stride_in_range() {
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
        fn the_frames_of_the_slower_stage_are_a_subset_of_those_of_the_faster(
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
