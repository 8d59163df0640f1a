//! Measures times: the shortest and the median of many runs.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use crate::stages::Times;

/// Measures a single thread by its processor time, and several threads by wall-clock time.
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

    /// Runs `work` until the time is used up, at least once and at most 400 times.
    pub(crate) fn measure(&self, mut work: impl FnMut()) -> Times {
        let begin = Instant::now();
        if !self.budget.is_zero() {
            work();
        }
        let clock = if self.alone {
            ClockId::ThreadCPUTime
        } else {
            ClockId::Monotonic
        };
        let mut all = Vec::new();
        let mut cpu = f64::INFINITY;
        while all.is_empty() || (begin.elapsed() < self.budget && all.len() < 400) {
            let before = [clock, ClockId::ProcessCPUTime].map(now_ms);
            work();
            all.push(now_ms(clock) - before[0]);
            cpu = cpu.min(now_ms(ClockId::ProcessCPUTime) - before[1]);
        }
        all.sort_by(f64::total_cmp);
        Times {
            min: all[0],
            median: all[all.len() / 2],
            cpu,
        }
    }
}

fn now_ms(clock: ClockId) -> f64 {
    let now = clock_gettime(clock);
    now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 * 1e-6
}
