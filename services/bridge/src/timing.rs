//! Durations of the newest few thousand messages.

use std::collections::VecDeque;

use serde::Serialize;

const MOST: usize = 4096;

/// Durations in nanoseconds. Only the newest are kept.
#[derive(Debug, Clone, Default)]
pub(crate) struct Timing(VecDeque<u64>);

/// Percentiles of durations, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Percentiles {
    n: usize,
    p50_ms: f64,
    p99_ms: f64,
}

impl Timing {
    pub(crate) fn add(&mut self, nanos: u64) {
        if self.0.len() == MOST {
            self.0.pop_front();
        }
        self.0.push_back(nanos);
    }

    /// Returns the percentiles; `None` if there are no durations.
    pub(crate) fn percentiles(&self) -> Option<Percentiles> {
        let mut sorted: Vec<u64> = self.0.iter().copied().collect();
        sorted.sort_unstable();
        let at = |share: f64| {
            let nth = (share * sorted.len() as f64).ceil() as usize;
            let nanos = *sorted.get(nth.clamp(1, sorted.len().max(1)) - 1)?;
            Some((nanos as f64 * 1e-3).round() * 1e-3)
        };
        Some(Percentiles {
            n: sorted.len(),
            p50_ms: at(0.5)?,
            p99_ms: at(0.99)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_durations_count() {
        let mut it = Timing::default();
        assert_eq!(it.percentiles(), None);
        for nth in 0..10_000_u64 {
            it.add(nth * 1_000_000);
        }
        let got = it.percentiles().unwrap();
        assert_eq!((got.n, got.p50_ms, got.p99_ms), (4096, 7951.0, 9959.0));
    }
}
