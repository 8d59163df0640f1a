//! Estimates the offset and drift of another host's clock, with a bound on the error.
//!
//! An exchange of four time stamps (RFC 5905, section 8) bounds the error of the offset by half of the round trip, however the delay is
//! divided between the two directions. The window is divided into parts. In each part, only the exchange with the shortest round trip is
//! used, as in the clock filter of NTP. A line through these exchanges gives offset and drift.

use std::collections::VecDeque;

/// Number of parts of the time window. The best exchange of each part is kept.
const N_PARTS: usize = 12;
/// Length of a part, in nanoseconds.
const PART_NANOS: u64 = 5_000_000_000;
/// Minimum time span of the exchanges from which a drift is estimated, in nanoseconds.
const LEAST_SPAN: u64 = 5_000_000_000;
/// Maximum relative drift of two clocks, which is assumed until the drift has been measured. The kernel adjusts each clock by at most 500
/// ppm.
const MOST_DRIFT: f64 = 1e-3;
/// Longest round trip that is used, in nanoseconds.
const MOST_TRIP: u64 = 2_000_000_000;
/// Number of consecutive exchanges that must contradict the estimate before the other clock counts as a new one.
const N_ODD: u32 = 3;

/// The four times of a question and its answer, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exchange {
    /// Time at which the question was sent, by this host's clock.
    pub asked_at: u64,
    /// Time at which the question arrived, by the other clock.
    pub received_at: u64,
    /// Time at which the answer was sent, by the other clock.
    pub answered_at: u64,
    /// Time at which the answer arrived, by this host's clock.
    pub heard_at: u64,
}

/// Error if the four times contradict each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ExchangeError {
    /// One of the clocks was set back.
    #[error("a clock was set back during the exchange")]
    Backwards,
    /// The other host claims to have taken longer than the whole exchange.
    #[error(
        "the other host claims that it answered after {inside} ns, but the whole exchange took only {outside} ns"
    )]
    Inside {
        /// Time from question to answer on the other host, in nanoseconds.
        inside: u64,
        /// Time from question to answer on this host, in nanoseconds.
        outside: u64,
    },
    /// The round trip was too long to compare the clocks.
    #[error("the round trip took {trip} ns, which is too long to compare the clocks")]
    Slow {
        /// Length of the round trip, in nanoseconds.
        trip: u64,
    },
}

/// Estimate of another host's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Offset of the other clock, in nanoseconds. Added to this host's time, it gives the other host's time.
    pub offset_nanos: i64,
    /// Drift in parts per billion: how much shorter a second of the other clock is than one of this host's clock.
    pub drift_ppb: f64,
    /// Bound on the error of the offset, in nanoseconds: half of the shortest round trip, plus the possible effect of the drift.
    pub bound_nanos: u64,
    /// Shortest round trip in the window, in nanoseconds.
    pub trip_nanos: u64,
    /// Number of exchanges used for the estimate.
    pub n_exchanges: usize,
}

impl Estimate {
    /// Converts a time of the other clock to this host's clock.
    pub fn ours(&self, theirs: u64) -> u64 {
        let ours = i128::from(theirs) - i128::from(self.offset_nanos);
        ours.clamp(0, i128::from(u64::MAX)) as u64
    }

    /// Converts a time of this host's clock to the other clock.
    pub fn theirs(&self, ours: u64) -> u64 {
        let theirs = i128::from(ours) + i128::from(self.offset_nanos);
        theirs.clamp(0, i128::from(u64::MAX)) as u64
    }

    /// Returns a warning if the bound is too large compared with the time between two frames.
    ///
    /// * `max_share`: largest bound without a warning, as a fraction of the time between two frames.
    pub fn warning(&self, period_nanos: u64, max_share: f64) -> Option<String> {
        let share = self.bound_nanos as f64 / period_nanos.max(1) as f64;
        (share > max_share).then(|| {
            format!(
                "the clock of this host is known only to within {:.3} ms, which is {:.0} % of the time between two frames \
                 (link.max_clock_share is {:.0} %), because a round trip on the network takes at least {:.3} ms; use a network with less \
                 traffic; if the cameras stamp their own pictures, run `chrony` or `linuxptp` on all hosts",
                self.bound_nanos as f64 * 1e-6,
                100.0 * share,
                100.0 * max_share,
                self.trip_nanos as f64 * 1e-6,
            )
        })
    }
}

/// An exchange in the form used for the estimate.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// Time of the middle of the exchange, by this host's clock, in nanoseconds.
    at: u64,
    /// The other clock minus this host's clock, in nanoseconds.
    offset: i64,
    trip: u64,
}

/// The clock of another host. The caller passes the time, so no clock is read.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    /// The best exchange of every part of the window, oldest first, with the index of the part.
    parts: VecDeque<(u64, Sample)>,
    n_exchanges: usize,
    n_odd: u32,
    n_resets: u32,
}

impl Clock {
    /// Adds an exchange.
    ///
    /// # Errors
    ///
    /// Fails with [`ExchangeError`] if the times contradict each other. The exchange is then not used.
    pub fn add(&mut self, exchange: Exchange) -> Result<(), ExchangeError> {
        let sample = sample(&exchange)?;
        if self.contradicts(&sample) {
            self.n_odd += 1;
            if self.n_odd < N_ODD {
                return Ok(());
            }
            // The other host was restarted, or its clock was set.
            self.parts.clear();
            (self.n_exchanges, self.n_resets) = (0, self.n_resets + 1);
        }
        self.n_odd = 0;
        self.n_exchanges += 1;
        let part = sample.at / PART_NANOS;
        match self.parts.back_mut().filter(|back_mut| back_mut.0 >= part) {
            Some((_, best)) if best.trip < sample.trip => {}
            Some((_, best)) => *best = sample,
            None => self.parts.push_back((part, sample)),
        }
        while self.parts.len() > N_PARTS
            || self.parts.front().is_some_and(|front| front.0 + (N_PARTS as u64) <= part)
        {
            self.parts.pop_front();
        }
        Ok(())
    }

    /// Forgets all exchanges, because the other bridge was restarted, perhaps with its host.
    pub fn forget(&mut self) {
        self.parts.clear();
        (self.n_exchanges, self.n_odd) = (0, 0);
    }

    /// Returns how often the other clock was found to be a new one.
    pub fn n_resets(&self) -> u32 {
        self.n_resets
    }

    /// Returns the estimate at a time of this host's clock; `None` before the first exchange.
    pub fn estimate(&self, now: u64) -> Option<Estimate> {
        let all = || self.parts.iter().map(|part| part.1);
        let best = all().min_by_key(|sample| sample.trip)?;
        let line = Line::through(&all(), best);
        let at = |time: u64| line.at(time);
        let bound = all().map(|sample| {
            // Sum of the exchange's own bound, its distance from the line, and the effect of an error of the drift since the exchange.
            let off = (at(sample.at) - sample.offset as f64).abs();
            let age = time_between(now, sample.at).abs();
            sample.trip as f64 / 2.0 + off + line.drift_error * age
        });
        let bound = bound.fold(f64::INFINITY, f64::min);
        Some(Estimate {
            offset_nanos: at(now).round() as i64,
            drift_ppb: line.drift * 1e9,
            bound_nanos: bound.ceil() as u64,
            trip_nanos: best.trip,
            n_exchanges: self.n_exchanges,
        })
    }

    /// Returns true if an exchange contradicts the current estimate of the clock.
    fn contradicts(&self, sample: &Sample) -> bool {
        let Some(known) = self.estimate(sample.at) else {
            return false;
        };
        let off = i128::from(sample.offset) - i128::from(known.offset_nanos);
        let most = (sample.trip / 2).saturating_add(known.bound_nanos);
        off.unsigned_abs() > u128::from(most) + 1_000_000
    }
}

fn sample(it: &Exchange) -> Result<Sample, ExchangeError> {
    let outside = it.heard_at.checked_sub(it.asked_at);
    let inside = it.answered_at.checked_sub(it.received_at);
    let (Some(outside), Some(inside)) = (outside, inside) else {
        return Err(ExchangeError::Backwards);
    };
    let trip = outside.checked_sub(inside).ok_or(ExchangeError::Inside { inside, outside })?;
    if trip > MOST_TRIP {
        return Err(ExchangeError::Slow { trip });
    }
    let there = i128::from(it.received_at) - i128::from(it.asked_at);
    let back = i128::from(it.answered_at) - i128::from(it.heard_at);
    let limits = [i64::MIN, i64::MAX].map(i128::from);
    Ok(Sample {
        at: it.asked_at + outside / 2,
        offset: i128::midpoint(there, back).clamp(limits[0], limits[1]) as i64,
        trip,
    })
}

/// Returns the difference between two times, in nanoseconds.
fn time_between(later: u64, earlier: u64) -> f64 {
    (i128::from(later) - i128::from(earlier)) as f64
}

/// Linear model of the offset over time.
struct Line {
    /// Reference time by this host's clock, in nanoseconds.
    origin: u64,
    /// Offset at the reference time, in nanoseconds.
    offset: f64,
    /// Change of the offset, in nanoseconds per nanosecond.
    drift: f64,
    /// Bound on the error of the drift.
    drift_error: f64,
}

impl Line {
    /// Fits a line to exchanges, weighted by the squares of their round trips. If the exchanges are too close in time, the line has no
    /// drift.
    fn through(all: &(impl Iterator<Item = Sample> + Clone), best: Sample) -> Self {
        let level = Self {
            origin: best.at,
            offset: best.offset as f64,
            drift: 0.0,
            drift_error: MOST_DRIFT,
        };
        let first = all.clone().min_by_key(|sample| sample.at);
        let last = all.clone().max_by_key(|sample| sample.at);
        let (Some(first), Some(last)) = (first, last) else {
            return level;
        };
        let span = last.at - first.at;
        if span < LEAST_SPAN {
            return level;
        }
        let [mut w, mut wx, mut wy, mut wxx, mut wxy] = [0.0; 5];
        for it in all.clone() {
            let weight = 1.0 / (it.trip as f64 + 1e3).powi(2);
            let x = time_between(it.at, best.at);
            let y = (i128::from(it.offset) - i128::from(best.offset)) as f64;
            (w, wx, wy) = (w + weight, wx + weight * x, wy + weight * y);
            (wxx, wxy) = (wxx + weight * x * x, wxy + weight * x * y);
        }
        let determinant = w * wxx - wx * wx;
        if determinant <= 0.0 {
            return level;
        }
        let drift = ((w * wxy - wx * wy) / determinant).clamp(-MOST_DRIFT, MOST_DRIFT);
        Self {
            origin: best.at,
            offset: best.offset as f64 + (wy - drift * wx) / w,
            drift,
            drift_error: drift_error(drift, all),
        }
    }

    fn at(&self, time: u64) -> f64 {
        self.offset + self.drift * time_between(time, self.origin)
    }
}

/// Returns a bound on the error of a drift. Any two exchanges give a bound, because at each exchange the offset is known to within half of
/// the round trip.
fn drift_error(drift: f64, all: &(impl Iterator<Item = Sample> + Clone)) -> f64 {
    let pairs = all
        .clone()
        .enumerate()
        .flat_map(|(nth, sample)| all.clone().skip(nth + 1).map(move |other| (sample, other)));
    let errors = pairs.filter_map(|(sample, other)| {
        let span = time_between(other.at, sample.at);
        let change = (i128::from(other.offset) - i128::from(sample.offset)) as f64;
        let unknown = f64::midpoint(sample.trip as f64, other.trip as f64) / span.abs();
        (span.abs() >= LEAST_SPAN as f64).then(|| (change / span - drift).abs() + unknown)
    });
    errors.fold(MOST_DRIFT + drift.abs(), f64::min)
}

#[cfg(test)]
mod tests;
