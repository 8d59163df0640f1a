//! Recent rates.

use std::collections::VecDeque;

use messages::{MAX_ROWS, Metrics};

/// The time window of the rates, in nanoseconds.
const REACH_NANOS: u64 = 5_000_000_000;
/// Shortest time from which a rate is computed, in nanoseconds.
const LEAST_NANOS: u64 = 200_000_000;

/// Rates over the last five seconds, or since the start.
#[derive(Debug)]
pub struct Rates {
    past: VecDeque<Past>,
}

#[derive(Debug, Clone, Copy)]
struct Past {
    at_nanos: u64,
    n_sent: u64,
    counts: [u64; MAX_ROWS],
}

impl Rates {
    /// Starts with counts of zero.
    ///
    /// * `at_nanos`: current time.
    pub fn new(at_nanos: u64) -> Self {
        let start = Past {
            at_nanos,
            n_sent: 0,
            counts: [0; MAX_ROWS],
        };
        Self {
            past: VecDeque::from([start]),
        }
    }

    /// Computes the rates of a message from its counts and time, and keeps these for the next message. Rows must keep their order
    /// from message to message.
    pub fn fill(&mut self, message: &mut Metrics) {
        let now = Past {
            at_nanos: message.at_nanos,
            n_sent: message.n_sent,
            counts: message.rows.map(|row| row.count),
        };
        while self.past.len() > 1
            && now.at_nanos.saturating_sub(self.past[1].at_nanos) > REACH_NANOS
        {
            self.past.pop_front();
        }
        let Some(then) = self.past.front() else {
            return;
        };
        let nanos = now.at_nanos.saturating_sub(then.at_nanos);
        if nanos >= LEAST_NANOS {
            message.sent_millihertz = per_second(now.n_sent, then.n_sent, nanos);
            for (row, then) in message.rows.iter_mut().zip(&then.counts) {
                row.millihertz = per_second(row.count, *then, nanos);
            }
        }
        self.past.push_back(now);
    }
}

/// Returns a rate in thousandths per second.
fn per_second(now: u64, then: u64, nanos: u64) -> u64 {
    let thousandths = u128::from(now.saturating_sub(then)) * 1_000_000_000_000 / u128::from(nanos);
    u64::try_from(thousandths).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    fn message(at_nanos: u64, n_sent: u64, count: u64) -> Metrics {
        let mut message_of_second = Metrics {
            at_nanos,
            n_sent,
            ..Metrics::default()
        };
        message_of_second.rows[1].count = count;
        message_of_second
    }

    fn rates(message_of_second: &Metrics) -> [u64; 2] {
        [
            message_of_second.sent_millihertz,
            message_of_second.rows[1].millihertz,
        ]
    }

    #[test]
    fn steady_events_have_a_constant_rate() {
        let mut rates_of = Rates::new(7 * SECOND);
        for second in 1..20 {
            let mut message_of_second = message((7 + second) * SECOND, 20 * second, 5 * second);
            rates_of.fill(&mut message_of_second);
            assert_eq!(rates(&message_of_second), [20_000, 5_000], "{second}");
        }
    }

    #[test]
    fn the_rate_is_zero_five_seconds_after_the_last_event() {
        let mut rates_of = Rates::new(0);
        let mut last = [1; 2];
        for second in 1..=12 {
            let mut message_of_second =
                message(second * SECOND, 100 * second.min(3), second.min(3));
            rates_of.fill(&mut message_of_second);
            let now = rates(&message_of_second);
            assert!(second <= 3 || now[0] <= last[0], "{second}: {now:?}");
            last = now;
        }
        assert_eq!(last, [0, 0]);
    }

    #[test]
    fn too_short_a_time_gives_no_rate() {
        let mut rates_of = Rates::new(0);
        let mut message_of_second = message(LEAST_NANOS - 1, 1000, 1000);
        rates_of.fill(&mut message_of_second);
        assert_eq!(rates(&message_of_second), [0, 0]);
    }

    #[test]
    fn memory_is_bounded_for_any_number_of_messages() {
        let mut rates_of = Rates::new(0);
        for nth in 0..10_000 {
            rates_of.fill(&mut message(nth * SECOND / 10, nth, nth));
        }
        assert!(rates_of.past.len() <= 52, "{}", rates_of.past.len());
    }
}
