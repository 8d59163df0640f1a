//! State of another host.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::hosts::{Clock, Difference, Estimate, Exchange};

use crate::job::NearHost;
use crate::join::listed;

/// Time without a message after which a host counts as not answering, in nanoseconds.
const SILENT_AFTER: u64 = 1_200_000_000;

/// Another host. The value is shared with the threads of the link.
#[derive(Debug)]
pub(super) struct Remote {
    pub(super) name: String,
    pub(super) views: Vec<usize>,
    state: Mutex<State>,
}

/// The part of a remote host that changes.
#[derive(Debug, Default, Clone)]
pub(super) struct State {
    pub(super) clock: Clock,
    /// Start time of the accepted bridge.
    pub(super) welcomed: Option<u64>,
    pub(super) refused: Option<Vec<Difference>>,
    heard_at: Option<u64>,
    pub(super) n_packets: u64,
    pub(super) n_bytes: u64,
    /// Number of malformed packets. The next field is the reason for the last one.
    pub(super) n_malformed: u64,
    pub(super) last_malformed: String,
    /// Number of packets from a bridge that has not been accepted.
    pub(super) n_unknown: u64,
    /// Number of packets that arrived before the clock of the host was known.
    pub(super) n_without_clock: u64,
    /// Number of packets for which there was no space, because the host sends too many.
    pub(super) n_no_room: u64,
    /// Number of times that the host appeared, and number of times that it disappeared.
    pub(super) n_came: u64,
    pub(super) n_went: u64,
    was_there: bool,
    has_warned: bool,
}

impl Remote {
    pub(super) fn new(host: &NearHost) -> Self {
        Self {
            name: host.name.clone(),
            views: host.views.clone(),
            state: Mutex::new(State::default()),
        }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records that a message of the host arrived.
    pub(super) fn heard(&self, now: u64) {
        self.state().heard_at = Some(now);
    }

    /// Returns true if the host was accepted, and has sent a message recently.
    pub(super) fn is_there(&self, now: u64) -> bool {
        self.state().is_there(now)
    }

    /// Returns the estimate of the host's clock.
    pub(super) fn estimate(&self, now: u64) -> Option<Estimate> {
        self.state().clock.estimate(now)
    }

    pub(super) fn count_without_clock(&self) {
        self.state().n_without_clock += 1;
    }

    /// Adds an exchange of times with the host.
    pub(super) fn exchanged(&self, exchange: Exchange) {
        let mut state = self.state();
        state.heard_at = Some(exchange.heard_at);
        if let Err(error) = state.clock.add(exchange) {
            tracing::debug!(%error, host = self.name, "the times of an exchange cannot be used");
        }
    }

    /// Records that a bridge of the host was accepted.
    pub(super) fn welcomed(&self, origin: u64, now: u64) {
        let mut state = self.state();
        state.heard_at = Some(now);
        if state.welcomed.replace(origin) != Some(origin) {
            // The host itself may have been restarted, in which case its clock is a new one.
            state.clock.forget();
            state.refused = None;
        }
    }

    /// Records that a bridge of the host was refused. Logs the reasons if they are new.
    pub(super) fn refused(&self, why: &[Difference]) {
        let mut state = self.state();
        if state.refused.as_deref() != Some(why) {
            let why = listed(why);
            tracing::warn!(
                host = self.name,
                "the host is not accepted, because its files or settings differ (\"this host\" in the following list means {}): {why}",
                self.name
            );
        }
        state.refused = Some(why.to_vec());
        state.welcomed = None;
    }

    /// Records that the host sent bytes that are not a packet.
    pub(super) fn malformed(&self, why: &dyn core::fmt::Display) {
        let mut state = self.state();
        state.n_malformed += 1;
        state.last_malformed = why.to_string();
        if state.n_malformed.is_power_of_two() {
            let n = state.n_malformed;
            tracing::warn!(host = self.name, %why, n, "messages from this host cannot be used");
        }
    }

    /// Logs when the host starts or stops answering. Also logs once if its clock is not known accurately enough.
    pub(super) fn watch(&self, now: u64, period_nanos: f64, max_share: f64) {
        let mut state = self.state();
        let is_there = state.is_there(now);
        if is_there != state.was_there {
            state.was_there = is_there;
            if is_there {
                state.n_came += 1;
                tracing::info!(host = self.name, "the host answers");
            } else {
                state.n_went += 1;
                tracing::warn!(
                    host = self.name,
                    "the host does not answer: its views are missing"
                );
            }
        }
        let estimate = state.clock.estimate(now).filter(|_| is_there);
        let settled = estimate.filter(|estimate| estimate.n_exchanges >= 20);
        let warning = settled.and_then(|settled| settled.warning(period_nanos as u64, max_share));
        if let Some(warning) = warning.filter(|_| !state.has_warned) {
            state.has_warned = true;
            tracing::warn!(host = self.name, "{warning}");
        }
    }
}

impl State {
    pub(super) fn is_there(&self, now: u64) -> bool {
        let is_heard = |at: u64| now.saturating_sub(at) < SILENT_AFTER;
        self.welcomed.is_some() && self.heard_at.is_some_and(is_heard)
    }
}
