//! How long something takes: the shortest and the median of many times.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use crate::stages::Times;

/// Times one thread by the processor time that it had, several by the clock on the wall.
#[derive(Debug)]
pub(crate) struct Clock {
    alone: bool,
    budget: Duration,
}

impl Clock {
    pub(crate) fn new(threads: usize, quick: bool) -> Self {
        Self {
            alone: threads == 1,
            budget: Duration::from_millis(if quick { 0 } else { 1500 }),
        }
    }

    fn now_ms(&self) -> f64 {
        let id = if self.alone {
            ClockId::ThreadCPUTime
        } else {
            ClockId::Monotonic
        };
        let now = clock_gettime(id);
        now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 * 1e-6
    }

    /// Does `work` until the time is used up, at least once and at most 400 times.
    pub(crate) fn measure(&self, mut work: impl FnMut()) -> Times {
        let begin = Instant::now();
        if !self.budget.is_zero() {
            work();
        }
        let mut all = Vec::new();
        while all.is_empty() || (begin.elapsed() < self.budget && all.len() < 400) {
            let before = self.now_ms();
            work();
            all.push(self.now_ms() - before);
        }
        all.sort_by(f64::total_cmp);
        Times {
            min: all[0],
            median: all[all.len() / 2],
        }
    }
}
