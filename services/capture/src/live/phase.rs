//! Measures the skew of a camera (the difference between the times of its pictures and the common instants), and its change over time.

use std::collections::VecDeque;

/// Number of pictures whose median skew is one measurement.
const N_PICTURES: usize = 15;
/// Time for which measurements are used, in nanoseconds.
const WINDOW_NANOS: u64 = 60_000_000_000;
/// Maximum number of measurements.
const MOST_MEASUREMENTS: usize = 240;
/// Minimum time for which a camera must have been measured before its drift is reported, in nanoseconds.
const LEAST_NANOS: u64 = 5_000_000_000;

/// Follows the skew of a camera. The caller passes the time, so no clock is read.
#[derive(Debug)]
pub(crate) struct Phase {
    period_nanos: u64,
    /// Times and skews of pictures that are not part of a measurement yet, in nanoseconds.
    newest: Vec<(u64, i64)>,
    /// Times and skews of the measurements, in nanoseconds. When a camera drifts so far that its pictures are assigned to other frames, a
    /// whole period is added to its skew, so that the skew does not jump.
    measured: VecDeque<(u64, i64)>,
    /// Sum of the periods that were added so far, in nanoseconds.
    added: i64,
    /// True if the times are from the camera's own clock.
    is_own_time: bool,
}

impl Phase {
    /// Creates a phase without measurements.
    ///
    /// * `period_nanos`: time from one frame to the next, in nanoseconds.
    pub(crate) fn new(period_nanos: u64) -> Self {
        Self {
            period_nanos,
            newest: Vec::with_capacity(N_PICTURES),
            measured: VecDeque::new(),
            added: 0,
            is_own_time: false,
        }
    }

    /// Starts again if the times of the following pictures are from a different clock than before.
    ///
    /// * `is_own_time`: true if the times are from the camera's own clock.
    pub(crate) fn by_clock(&mut self, is_own_time: bool) {
        if is_own_time != self.is_own_time {
            *self = Self {
                is_own_time,
                ..Self::new(self.period_nanos)
            };
        }
    }

    /// Adds a picture. Returns true if there is a new measurement.
    ///
    /// * `skew_nanos`: time from the nominal time of the picture's frame until the picture was taken, in nanoseconds.
    pub(crate) fn add(&mut self, at_nanos: u64, skew_nanos: i64) -> bool {
        self.newest.push((at_nanos, skew_nanos));
        if self.newest.len() < N_PICTURES {
            return false;
        }
        self.newest.sort_unstable_by_key(|picture| picture.1);
        let (_, skew) = self.newest[N_PICTURES / 2];
        self.newest.clear();
        let period = self.period_nanos.max(1).cast_signed();
        if let Some((_, last)) = self.measured.back() {
            let jump = skew.saturating_add(self.added).saturating_sub(*last);
            let n_periods = (jump as f64 / period as f64).round() as i64;
            self.added = self.added.saturating_sub(n_periods.saturating_mul(period));
        }
        self.measured.push_back((at_nanos, skew.saturating_add(self.added)));
        let begin = at_nanos.saturating_sub(WINDOW_NANOS);
        while self.measured.len() > MOST_MEASUREMENTS
            || self.measured.front().is_some_and(|measured| measured.0 < begin)
        {
            self.measured.pop_front();
        }
        true
    }

    /// Returns the median skew of the last pictures, in nanoseconds; `None` if there are too few pictures.
    pub(crate) fn skew_nanos(&self) -> Option<i64> {
        self.measured.back().map(|measured| measured.1.saturating_sub(self.added))
    }

    /// Returns how fast the camera falls behind the nominal frame times, in parts per billion. It is negative for a camera that is too
    /// fast. Returns `None` if the camera was measured for too short a time.
    pub(crate) fn drift_ppb(&self) -> Option<i64> {
        let ends = self.measured.front().zip(self.measured.back())?;
        if ends.1.0.saturating_sub(ends.0.0) < LEAST_NANOS {
            return None;
        }
        let n = self.measured.len() as f64;
        let from = *ends.0;
        let place = |picture: &(u64, i64)| {
            (
                (picture.0.wrapping_sub(from.0)) as f64,
                picture.1.wrapping_sub(from.1) as f64,
            )
        };
        let sums = self.measured.iter().map(place);
        let (x, y) = sums.fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
        let (x, y) = (x / n, y / n);
        let products = self
            .measured
            .iter()
            .map(place)
            .map(|point| point.0 - x)
            .zip(self.measured.iter().map(place).map(|point| point.1 - y));
        let (above, below) =
            products.fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x * y, sum.1 + x * x));
        (below > 0.0).then(|| (1e9 * above / below).round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 33_333_333;

    /// Returns the phase of a camera after some seconds.
    ///
    /// * `interval`: time between pictures, in nanoseconds.
    fn after(seconds: u64, interval: f64, jitter: i64) -> Phase {
        let mut phase = Phase::new(PERIOD);
        for nth in 0..30 * seconds {
            let at = 4e9 + nth as f64 * interval;
            let exact = (at - 4e9) / PERIOD as f64;
            let skew = ((exact - exact.round()) * PERIOD as f64) as i64;
            let jitter = if nth % 2 == 0 { jitter } else { -jitter };
            phase.add(at as u64, skew + jitter);
        }
        phase
    }

    #[test]
    fn a_camera_at_29_97_falls_behind_by_a_thousandth() {
        let phase = after(100, PERIOD as f64 * 30.0 / 29.97, 2_000_000);
        let ppm = phase.drift_ppb().unwrap() as f64 / 1e3;
        assert!((ppm - 1000.0).abs() < 20.0, "{ppm}");
        assert!(phase.skew_nanos().unwrap().unsigned_abs() <= PERIOD / 2 + 2_000_000);
    }

    #[test]
    fn a_slightly_fast_camera_clock_is_detected_within_a_minute() {
        let phase = after(60, PERIOD as f64 * (1.0 - 30e-6), 500_000);
        let ppm = phase.drift_ppb().unwrap() as f64 / 1e3;
        assert!((ppm + 30.0).abs() < 5.0, "{ppm}");
    }

    #[test]
    fn a_change_of_the_clock_is_not_reported_as_drift() {
        let mut phase = after(60, PERIOD as f64, 0);
        phase.by_clock(true);
        assert_eq!((phase.skew_nanos(), phase.drift_ppb()), (None, None));
        for nth in 0..600 {
            phase.by_clock(true);
            phase.add(70_000_000_000 + nth * PERIOD, -9_000_000);
        }
        assert_eq!(phase.skew_nanos(), Some(-9_000_000));
        assert!(phase.drift_ppb().unwrap().abs() < 1000);
    }

    #[test]
    fn no_drift_is_reported_before_enough_measurements() {
        assert_eq!(Phase::new(PERIOD).skew_nanos(), None);
        let phase = after(3, PERIOD as f64, 0);
        assert_eq!((phase.skew_nanos(), phase.drift_ppb()), (Some(0), None));
    }

    #[test]
    fn impossible_numbers_do_not_overflow() {
        let mut phase = Phase::new(0);
        for nth in 0..200_u64 {
            let skew = if nth % 2 == 0 { i64::MAX } else { i64::MIN };
            phase.add(nth.wrapping_mul(u64::MAX / 7), skew);
        }
        let _any = (phase.skew_nanos(), phase.drift_ppb());
    }
}
