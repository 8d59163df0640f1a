//! The times at which frames are due.

/// Computes the time at which frame `k` is due, `start + k / rate`, on a clock that the caller reads.
///
/// All cameras of a deployment have the same start, so that frames with the same index are due at the same time. This type does not read a
/// clock and does not sleep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacer {
    start_nanos: u64,
    rate_hz: Option<f64>,
}

impl Pacer {
    /// Returns a pacer for which every frame is due immediately.
    pub const fn as_fast_as_possible() -> Self {
        Self {
            start_nanos: 0,
            rate_hz: None,
        }
    }

    /// Returns a pacer for which frame `k` is due `k / rate_hz` seconds after `start_nanos`.
    ///
    /// # Panics
    ///
    /// Panics if `rate_hz` is not a positive finite number.
    pub fn realtime(start_nanos: u64, rate_hz: f64) -> Self {
        assert!(
            rate_hz.is_finite() && rate_hz > 0.0,
            "a frame rate is positive, got {rate_hz}"
        );
        Self {
            start_nanos,
            rate_hz: Some(rate_hz),
        }
    }

    /// Returns the time at which frame `k` is due, in nanoseconds of the caller's clock; 0 without a rate.
    pub fn due_nanos(&self, k: u64) -> u64 {
        match self.rate_hz {
            None => 0,
            Some(rate_hz) => {
                self.start_nanos.saturating_add((k as f64 * 1e9 / rate_hz).round() as u64)
            }
        }
    }

    /// Returns the time from `now_nanos` until frame `k` is due; 0 if it is already due.
    pub fn wait_nanos(&self, k: u64, now_nanos: u64) -> u64 {
        self.due_nanos(k).saturating_sub(now_nanos)
    }

    /// Returns the latest frame that is due, for a reader that drops missed frames.
    ///
    /// Returns `None` before the start. Without a rate, it always returns `None`, because no frame can be missed.
    /// The result satisfies `due_nanos(k) <= now_nanos < due_nanos(k + 1)`.
    pub fn latest_due(&self, now_nanos: u64) -> Option<u64> {
        let rate_hz = self.rate_hz?;
        let elapsed = now_nanos.checked_sub(self.start_nanos)?;
        let mut k = (elapsed as f64 * 1e-9 * rate_hz) as u64;
        while k > 0 && self.due_nanos(k) > now_nanos {
            k -= 1;
        }
        while k < u64::MAX && self.due_nanos(k + 1) <= now_nanos {
            k += 1;
        }
        Some(k)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn without_a_rate_every_frame_is_due_and_none_is_missed() {
        let pacer = Pacer::as_fast_as_possible();
        assert_eq!(pacer.due_nanos(1_000_000), 0);
        assert_eq!(pacer.wait_nanos(1_000_000, 5), 0);
        assert_eq!(pacer.latest_due(u64::MAX), None);
    }

    #[test]
    fn frames_are_due_at_the_rate() {
        let pacer = Pacer::realtime(1_000, 50.0);
        assert_eq!(pacer.due_nanos(0), 1_000);
        assert_eq!(pacer.due_nanos(3), 60_001_000);
        assert_eq!(pacer.wait_nanos(3, 60_000_000), 1_000);
        assert_eq!(pacer.wait_nanos(3, 70_000_000), 0);
    }

    #[test]
    fn nothing_is_due_before_the_start() {
        let pacer = Pacer::realtime(1_000, 50.0);
        assert_eq!(pacer.latest_due(999), None);
        assert_eq!(pacer.latest_due(1_000), Some(0));
    }

    #[test]
    fn a_fractional_rate_does_not_drift_within_a_day() {
        let pacer = Pacer::realtime(0, 60_000.0 / 1001.0);
        // At 60 000 / 1001 Hz, 60 000 frames take 1001 seconds.
        assert_eq!(pacer.due_nanos(60_000 * 86), 1001 * 86 * 1_000_000_000);
    }

    proptest! {
        #[test]
        fn from_its_due_time_a_frame_is_the_latest_due_frame(
            start in 0_u64..1 << 60, rate_hz in 0.1..2000.0, k in 0_u64..10_000_000,
        ) {
            let pacer = Pacer::realtime(start, rate_hz);
            prop_assert_eq!(pacer.latest_due(pacer.due_nanos(k)), Some(k));
        }

        #[test]
        fn the_latest_frame_is_due_and_the_next_is_not(
            start in 0_u64..1 << 60, rate_hz in 0.1..2000.0, elapsed in 0_u64..1 << 47,
        ) {
            let pacer = Pacer::realtime(start, rate_hz);
            let k = pacer.latest_due(start + elapsed).unwrap();
            prop_assert!(pacer.due_nanos(k) <= start + elapsed);
            prop_assert!(start + elapsed < pacer.due_nanos(k + 1));
        }
    }
}
