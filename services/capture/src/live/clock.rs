//! Converts times of a camera's clock to the clock of this machine.

use std::collections::VecDeque;

/// Length of the window in which the smallest delay is searched, in nanoseconds. It is long enough to contain a packet with little delay,
/// and so short that clock drift does not matter.
const WINDOW_NANOS: u64 = 10_000_000_000;
/// Change of the offset, in nanoseconds, that shows that the camera's clock was set.
const JUMP_NANOS: u64 = 2_000_000_000;

/// Shortest and longest plausible delay of a picture according to the camera's clock, in nanoseconds. No picture arrives before it was
/// taken, and pictures that arrive later than the longest delay are not used.
const DELAYS_NANOS: [i64; 2] = [0, 150_000_000];
/// Amount by which a trusted clock may exceed these limits, in nanoseconds, so that a short deviation does not matter.
const SLACK_NANOS: i64 = 5_000_000;
/// Number of pictures before the clock of a camera is judged.
const N_FOR_VERDICT: u32 = 30;

/// Running minimum of the numbers of the last ten seconds. Stores pairs of time and number; both are in ascending order.
#[derive(Debug, Default)]
struct Least(VecDeque<(u64, i64)>);

impl Least {
    /// Adds a number. A number that is far from the earlier numbers shows that the clock was set.
    ///
    /// * Returns the minimum.
    fn add(&mut self, at_nanos: u64, number: i64) -> i64 {
        let all = &mut self.0;
        let is_jump = |&(_, least): &(u64, i64)| number.abs_diff(least) > JUMP_NANOS;
        if all.back().is_some_and(is_jump) {
            all.clear();
        }
        while all.back().is_some_and(|last| last.1 >= number) {
            all.pop_back();
        }
        all.push_back((at_nanos, number));
        let begin = at_nanos.saturating_sub(WINDOW_NANOS);
        while all.front().is_some_and(|first| first.0 < begin) {
            all.pop_front();
        }
        all.front().map_or(number, |least| least.1)
    }
}

/// Converts presentation times to `CLOCK_MONOTONIC`, using the smallest delay of the last ten seconds. The intervals between frames are
/// kept even if some frames were delayed in transit.
#[derive(Debug, Default)]
pub(super) struct ClockMap(Least);

impl ClockMap {
    /// Returns the time at which a picture was taken, plus the delay that all pictures share. It is never later than the arrival.
    ///
    /// * `presented_nanos`: presentation time by the camera's clock.
    /// * `arrived_at_nanos`: time of arrival by this machine's clock.
    pub(super) fn taken_at(&mut self, presented_nanos: i64, arrived_at_nanos: u64) -> u64 {
        let offset = arrived_at_nanos.cast_signed().saturating_sub(presented_nanos);
        let least = self.0.add(arrived_at_nanos, offset);
        presented_nanos.saturating_add(least).max(0).cast_unsigned()
    }
}

/// Verdict on the clock of a camera.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Verdict {
    /// There are too few pictures so far.
    #[default]
    Unknown,
    /// The camera's clock agrees with this machine's clock.
    Right,
    /// The camera's clock differs from this machine's clock, or the pictures arrive too late.
    Wrong,
}

/// Judges the clock of a camera that states the times of its pictures, by the delays of the pictures.
///
/// A small error of a clock cannot be distinguished from the transfer time of a picture. If the error is large, pictures seem to come from
/// the future, or to arrive too late to be used.
#[derive(Debug, Default)]
pub(super) struct OwnClock {
    least: Least,
    n: u32,
    /// Verdict so far.
    pub(super) verdict: Verdict,
    /// Shortest delay of the last ten seconds, in nanoseconds.
    pub(super) delay_nanos: i64,
}

impl OwnClock {
    /// Returns the time at which a picture was taken, by `CLOCK_MONOTONIC`. It is never later than the arrival. Returns `None` while the
    /// clock is not trusted.
    ///
    /// * `taken_unix`: time by the camera's clock, in nanoseconds since the beginning of 1970.
    /// * `arrived_unix`: time of arrival by this machine's clock, in nanoseconds since the beginning of 1970.
    /// * `arrived_at_nanos`: time of arrival by `CLOCK_MONOTONIC`.
    pub(super) fn taken_at(
        &mut self,
        [taken_unix, arrived_unix]: [i64; 2],
        arrived_at_nanos: u64,
    ) -> Option<u64> {
        let delay = arrived_unix.saturating_sub(taken_unix);
        self.delay_nanos = self.least.add(arrived_at_nanos, delay);
        self.n = self.n.saturating_add(1);
        let slack = if self.verdict == Verdict::Right {
            SLACK_NANOS
        } else {
            0
        };
        let [least, most] = DELAYS_NANOS;
        if self.n >= N_FOR_VERDICT {
            let is_right = (least - slack..=most + slack).contains(&self.delay_nanos);
            self.verdict = if is_right {
                Verdict::Right
            } else {
                Verdict::Wrong
            };
        }
        let taken = arrived_at_nanos.saturating_sub_signed(delay.max(0));
        (self.verdict == Verdict::Right).then_some(taken)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn frames_delayed_in_transit_keep_their_intervals() {
        let mut map = ClockMap::default();
        let of = |(nth, delay): (u64, u64)| {
            let presented = (nth * 40 * MS).cast_signed();
            map.taken_at(presented, 1_000 * MS + nth * 40 * MS + delay * MS)
        };
        let got: Vec<u64> =
            [5, 5, 30, 9, 6].into_iter().zip(0..).map(|(d, n)| (n, d)).map(of).collect();
        let expected: Vec<u64> = (0..5).map(|nth| 1_005 * MS + nth * 40 * MS).collect();
        assert_eq!(got, expected);
    }

    #[test]
    fn a_change_of_the_clock_is_followed_at_once() {
        let mut map = ClockMap::default();
        map.taken_at(0, 1_000 * MS);
        let later = map.taken_at(3_600_000 * MS as i64, 1_040 * MS);
        assert_eq!(later, 1_040 * MS);
        assert_eq!(map.taken_at(0, 1_080 * MS), 1_080 * MS);
    }

    #[test]
    fn a_constant_delay_becomes_the_minimum_delay_after_the_window() {
        let mut map = ClockMap::default();
        map.taken_at(0, 0);
        let mut last = 0;
        for nth in 1..400_u64 {
            last = map.taken_at((nth * 40 * MS).cast_signed(), nth * 40 * MS + 20 * MS);
        }
        assert_eq!(last, 399 * 40 * MS + 20 * MS);
    }

    /// Judges a camera whose clock is ahead by some milliseconds and whose pictures have some delay. Returns verdict, delay and last time.
    fn judged(ahead_ms: i64, delay_ms: impl Fn(u64) -> u64) -> (Verdict, i64, Option<u64>) {
        let mut clock = OwnClock::default();
        let mut last = None;
        for nth in 0..100_u64 {
            let taken = 1_000 * MS + nth * 40 * MS;
            let arrived = taken + delay_ms(nth) * MS;
            let unix = |nanos: u64| 1_700_000_000 * 1_000_000_000 + nanos.cast_signed();
            let shown = unix(taken) + ahead_ms * MS as i64;
            last = clock.taken_at([shown, unix(arrived)], arrived);
            assert!(last.is_none_or(|value| value <= arrived));
        }
        (clock.verdict, clock.delay_nanos / MS as i64, last)
    }

    #[test]
    fn the_delay_of_a_camera_that_uses_the_clock_of_this_machine_is_removed() {
        let taken = 1_000 * MS + 99 * 40 * MS;
        let held_up = |nth: u64| if nth.is_multiple_of(9) { 30 } else { 140 };
        assert_eq!(judged(0, held_up), (Verdict::Right, 30, Some(taken)));
    }

    #[test]
    fn a_clock_that_dates_pictures_in_the_future_or_too_far_in_the_past_is_rejected() {
        assert_eq!(judged(50, |_| 30), (Verdict::Wrong, -20, None));
        assert_eq!(judged(-3_600_000, |_| 30).0, Verdict::Wrong);
        assert_eq!(judged(0, |_| 151), (Verdict::Wrong, 151, None));
    }

    #[test]
    fn a_trusted_clock_survives_a_short_error_and_a_changed_clock_is_judged_again() {
        let mut clock = OwnClock::default();
        let mut at = 0;
        let mut seconds = |n: u64, ahead: i64, clock: &mut OwnClock| {
            for _ in 0..25 * n {
                at += 40 * MS;
                let arrived = at.cast_signed();
                clock.taken_at([arrived - 3 * MS as i64 + ahead, arrived], at);
            }
            clock.verdict
        };
        assert_eq!(seconds(2, 0, &mut clock), Verdict::Right);
        assert_eq!(
            seconds(2, 6 * MS as i64, &mut clock),
            Verdict::Right,
            "-3 ms"
        );
        assert_eq!(
            seconds(2, 9 * MS as i64, &mut clock),
            Verdict::Wrong,
            "-6 ms"
        );
        assert_eq!(seconds(20, 0, &mut clock), Verdict::Right);
    }

    /// Most times are within ten seconds.
    fn any_time() -> impl Strategy<Value = i64> {
        prop_oneof![9 => 0_i64..10_000_000_000, 1 => any::<i64>()]
    }

    proptest! {
        #[test]
        fn any_camera_times_get_a_verdict(
            times in prop::collection::vec((any_time(), any_time(), any_time()), 1..50),
        ) {
            let mut clock = OwnClock::default();
            for (taken, arrived, at) in times {
                let at = at.unsigned_abs();
                let got = clock.taken_at([taken, arrived], at);
                prop_assert!(got.is_none_or(|value| value <= at));
            }
        }

        #[test]
        fn no_capture_time_is_later_than_the_arrival(times in prop::collection::vec((any_time(), any::<u32>()), 1..50)) {
            let mut map = ClockMap::default();
            let mut now = 0;
            for (presented, pause) in times {
                now += u64::from(pause);
                prop_assert!(map.taken_at(presented, now) <= now);
            }
        }
    }
}
