//! From the clock of a camera to that of this machine.

use std::collections::VecDeque;

/// For how long an offset counts, nanoseconds: long enough that some packet was quick, short enough that clocks do not part.
const WINDOW_NANOS: u64 = 10_000_000_000;
/// A change of the offset by which the camera's clock was set, nanoseconds.
const JUMP_NANOS: u64 = 2_000_000_000;

/// Moves presentation times to `CLOCK_MONOTONIC`: by the least delay of the last ten seconds, so that frames that were held up
/// on the way keep their distances.
#[derive(Debug, Default)]
pub(super) struct ClockMap {
    /// Arrival and offset, both ascending: the first is the least offset of the window.
    least: VecDeque<(u64, i64)>,
}

impl ClockMap {
    /// When a picture was taken, but for the delay that every picture has; never later than it arrived.
    ///
    /// * `presented_nanos`: by the camera's clock.
    /// * `arrived_at_nanos`: by that of this machine.
    pub(super) fn taken_at(&mut self, presented_nanos: i64, arrived_at_nanos: u64) -> u64 {
        let offset = arrived_at_nanos
            .cast_signed()
            .saturating_sub(presented_nanos);
        let is_jump = |&(_, least): &(u64, i64)| offset.abs_diff(least) > JUMP_NANOS;
        if self.least.back().is_some_and(is_jump) {
            self.least.clear();
        }
        while self.least.back().is_some_and(|it| it.1 >= offset) {
            self.least.pop_back();
        }
        self.least.push_back((arrived_at_nanos, offset));
        let begin = arrived_at_nanos.saturating_sub(WINDOW_NANOS);
        while self.least.front().is_some_and(|it| it.0 < begin) {
            self.least.pop_front();
        }
        let least = self.least.front().map_or(offset, |it| it.1);
        presented_nanos.saturating_add(least).max(0).cast_unsigned()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn frames_that_were_held_up_keep_their_distances() {
        let mut map = ClockMap::default();
        let of = |(nth, delay): (u64, u64)| {
            let presented = (nth * 40 * MS).cast_signed();
            map.taken_at(presented, 1_000 * MS + nth * 40 * MS + delay * MS)
        };
        let got: Vec<u64> = [5, 5, 30, 9, 6]
            .into_iter()
            .zip(0..)
            .map(|(d, n)| (n, d))
            .map(of)
            .collect();
        let expected: Vec<u64> = (0..5).map(|nth| 1_005 * MS + nth * 40 * MS).collect();
        assert_eq!(got, expected);
    }

    #[test]
    fn a_clock_that_is_set_is_followed_at_once() {
        let mut map = ClockMap::default();
        map.taken_at(0, 1_000 * MS);
        let later = map.taken_at(3_600_000 * MS as i64, 1_040 * MS);
        assert_eq!(later, 1_040 * MS);
        assert_eq!(map.taken_at(0, 1_080 * MS), 1_080 * MS);
    }

    #[test]
    fn a_delay_that_stays_is_the_least_after_the_window() {
        let mut map = ClockMap::default();
        map.taken_at(0, 0);
        let mut last = 0;
        for nth in 1..400_u64 {
            last = map.taken_at((nth * 40 * MS).cast_signed(), nth * 40 * MS + 20 * MS);
        }
        assert_eq!(last, 399 * 40 * MS + 20 * MS);
    }

    proptest! {
        #[test]
        fn nothing_is_taken_after_it_arrived(times in prop::collection::vec(any::<(i64, u32)>(), 1..50)) {
            let mut map = ClockMap::default();
            let mut now = 0;
            for (presented, pause) in times {
                now += u64::from(pause);
                prop_assert!(map.taken_at(presented, now) <= now);
            }
        }
    }
}
