//! The instants (nominal frame times) that all cameras of a run share, and the assignment of pictures to them.

use std::collections::VecDeque;

use messages::Status;

/// Tolerance added to the largest difference between the time of a picture and the nominal time of its frame, in periods. With it, pictures
/// whose times jitter around the midpoint between two frame times are still assigned to the same frames.
const SLACK: f64 = 0.1;
/// Number of intervals whose median is the period of a camera.
const N_INTERVALS: usize = 15;
/// Minimum number of intervals that are needed for the period.
const LEAST_INTERVALS: usize = 5;
/// Largest accepted difference between a camera's clock and this machine's clock, in nanoseconds.
const MAX_OFF_NANOS: u64 = 2_000_000_000;

/// The frame times `start + k / rate`. The caller passes the time, so no clock is read.
#[derive(Debug)]
pub(crate) struct Grid {
    start_nanos: u64,
    period: f64,
    /// Time of the last picture, and newest intervals between pictures, in nanoseconds.
    last: Option<u64>,
    intervals: VecDeque<u64>,
}

impl Grid {
    /// Creates the frame times.
    ///
    /// * `rate_hz`: number of frames per second.
    pub(crate) fn new(start_nanos: u64, rate_hz: f64) -> Self {
        Self {
            start_nanos,
            period: 1e9 / rate_hz,
            last: None,
            intervals: VecDeque::with_capacity(N_INTERVALS + 1),
        }
    }

    /// Returns the time from one frame to the next, in nanoseconds.
    pub(crate) fn period_nanos(&self) -> u64 {
        self.period.round() as u64
    }

    /// Returns the nominal time of a frame, in nanoseconds.
    pub(crate) fn due_nanos(&self, nth: u64) -> u64 {
        self.start_nanos.saturating_add((nth as f64 * self.period).round() as u64)
    }

    /// Returns the index of the last frame whose nominal time is not after `now_nanos`; 0 if no such frame exists.
    pub(crate) fn latest(&self, now_nanos: u64) -> u64 {
        self.exact(now_nanos).max(0.0) as u64
    }

    /// Returns the time since the first frame, in seconds.
    pub(crate) fn seconds(&self, at_nanos: u64) -> f64 {
        self.exact(at_nanos) * self.period * 1e-9
    }

    /// Returns the time from the nominal time of a frame until a picture was taken, in nanoseconds.
    pub(crate) fn off_nanos(&self, at_nanos: u64, nth: u64) -> i64 {
        ((self.exact(at_nanos) - nth as f64) * self.period).round() as i64
    }

    /// Converts a time to a fractional frame index.
    fn exact(&self, at_nanos: u64) -> f64 {
        at_nanos.cast_signed().wrapping_sub(self.start_nanos.cast_signed()) as f64 / self.period
    }

    /// Returns the fault in the time of a picture, if there is one. The time is wrong if it is not later than the time of the previous
    /// picture, or differs much from the current time.
    pub(crate) fn wrong_clock(&mut self, at_nanos: u64, arrived_at_nanos: u64) -> Option<Status> {
        if at_nanos.abs_diff(arrived_at_nanos) > MAX_OFF_NANOS {
            return Some(Status::CLOCK_JUMPED);
        }
        let last = self.last.replace(at_nanos);
        let last = last.filter(|value| value.abs_diff(at_nanos) <= MAX_OFF_NANOS)?;
        if at_nanos > last {
            self.intervals.push_back(at_nanos - last);
            if self.intervals.len() > N_INTERVALS {
                self.intervals.pop_front();
            }
            return None;
        }
        // If the clock was set back, only one picture counts as wrong.
        Some(if at_nanos == last {
            Status::TIME_REPEATED
        } else {
            Status::TIME_WENT_BACK
        })
    }

    /// Measures the period of the camera from the times of its first pictures, which must be in ascending order.
    pub(crate) fn learn(&mut self, times: impl Iterator<Item = u64>) {
        for at_nanos in times.take(N_INTERVALS + 1) {
            self.wrong_clock(at_nanos, at_nanos);
        }
        self.last = None;
    }

    /// Returns the index of the frame to which a picture belongs: `next` or a later one. Returns `None` if every frame near the time of the
    /// picture already has a picture.
    ///
    /// The time of a picture may differ from the nominal time of its frame by half the frame period or, if the camera is faster, by half
    /// the period of the camera, plus a tolerance of a tenth of the period. Therefore, cameras with the same rate keep their phase, and the
    /// nearest picture of a faster camera is used.
    pub(crate) fn place(&self, at_nanos: u64, next: u64) -> Option<u64> {
        let exact = self.exact(at_nanos);
        let reach = 0.5 * self.own_period().min(1.0) + SLACK;
        if (exact - next as f64).abs() <= reach {
            return Some(next);
        }
        let nearest = exact.round();
        let is_later = nearest > next as f64 && (exact - nearest).abs() <= reach;
        is_later.then_some(nearest as u64)
    }

    /// Returns the period of the camera, in frame periods of the run.
    fn own_period(&self) -> f64 {
        if self.intervals.len() < LEAST_INTERVALS {
            return 1.0;
        }
        let mut sorted: Vec<u64> = self.intervals.iter().copied().collect();
        sorted.sort_unstable();
        sorted[sorted.len() / 2] as f64 / self.period
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const START: u64 = 5_000_000_000;

    /// Returns the frames to which pictures are assigned. The times of the pictures are given in periods of 30 Hz after the first frame.
    fn placed(times: impl IntoIterator<Item = f64>) -> Vec<Option<u64>> {
        let mut grid = Grid::new(START, 30.0);
        let mut next = 0;
        let mut all = Vec::new();
        for time in times {
            let at = (START as f64 + time * 1e9 / 30.0) as u64;
            assert_eq!(grid.wrong_clock(at, at), None);
            let nth = grid.place(at, next);
            next = nth.map_or(next, |nth| nth + 1);
            all.push(nth);
        }
        all
    }

    fn n_surplus(all: &[Option<u64>]) -> usize {
        all.iter().filter(|instant| instant.is_none()).count()
    }

    #[test]
    fn a_camera_of_the_same_rate_keeps_its_phase_despite_jitter() {
        for phase in [0.0, 0.3, 0.5, -0.45] {
            let jitter = |nth: u64| if nth.is_multiple_of(2) { 0.04 } else { -0.04 };
            let all = placed((1..200).map(|nth| nth as f64 + phase + jitter(nth)));
            let instants: Vec<u64> = all.iter().flatten().copied().collect();
            assert_eq!(n_surplus(&all), 0, "{phase}");
            assert!(
                instants.windows(2).all(|pair| pair[1] == pair[0] + 1),
                "{phase}: {instants:?}"
            );
        }
    }

    #[test]
    fn a_camera_at_29_97_hz_misses_one_in_a_thousand_instants_at_30_hz() {
        let all = placed((0..9990).map(|nth| f64::from(nth) * 30.0 / 29.97));
        let last = all.iter().flatten().last().unwrap();
        assert_eq!(n_surplus(&all), 0);
        assert!((9998..=10_001).contains(last), "{last}");
        let fast = placed((0..10_010).map(|nth| f64::from(nth) * 29.97 / 30.0));
        assert!((9..=11).contains(&n_surplus(&fast)), "{}", n_surplus(&fast));
    }

    #[test]
    fn at_twice_the_rate_the_nearest_picture_of_each_instant_is_used() {
        let all = placed((0..400).map(|nth| f64::from(nth) * 0.5));
        let settled = &all[20..];
        assert_eq!(n_surplus(settled), settled.len() / 2);
        assert!(
            settled.iter().step_by(2).all(Option::is_some),
            "those on the instants"
        );
    }

    #[test]
    fn at_half_the_rate_every_second_instant_has_no_picture() {
        let all = placed((0..100).map(|nth| f64::from(nth) * 2.0));
        let expected: Vec<Option<u64>> = (0..100).map(|nth| Some(nth * 2)).collect();
        assert_eq!(all, expected);
    }

    #[test]
    fn pictures_before_the_first_instant_belong_to_no_instant() {
        assert_eq!(
            placed([-3.0, -0.9, -0.2, 1.0]),
            [None, None, Some(0), Some(1)]
        );
    }

    #[test]
    fn timestamps_that_repeat_go_back_or_belong_to_another_day_are_wrong() {
        let mut grid = Grid::new(START, 30.0);
        let at = START + 7;
        assert_eq!(grid.wrong_clock(at, at), None);
        assert_eq!(grid.wrong_clock(at, at + 9), Some(Status::TIME_REPEATED));
        assert_eq!(
            grid.wrong_clock(at - 1, at + 9),
            Some(Status::TIME_WENT_BACK)
        );
        assert_eq!(grid.wrong_clock(at, at + 9), None, "it goes on from there");
        assert_eq!(grid.wrong_clock(7, at), Some(Status::CLOCK_JUMPED));
    }

    proptest! {
        #[test]
        fn no_instant_is_used_twice_or_by_a_distant_picture(
            times in prop::collection::vec(0.0..100.0, 1..100),
        ) {
            let mut times = times;
            times.sort_by(f64::total_cmp);
            times.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
            let all = placed(times.iter().copied());
            let mut least = 0;
            for (nth, time) in all.into_iter().zip(times) {
                let Some(nth) = nth else { continue };
                prop_assert!(nth >= least && (nth as f64 - time).abs() <= 0.6 + 1e-6);
                least = nth + 1;
            }
        }
    }
}
