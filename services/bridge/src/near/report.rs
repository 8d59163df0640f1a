//! The state of all hosts as JSON, for `parallax hosts status` and as a file beside the results.

use core::time::Duration;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::hosts::{Estimate, Tally};
use failure::now_nanos;
use serde_json::{Value, json};

use super::listen::Arrived;
use super::remote::Remote;
use crate::timing::Timing;

/// Durations of a view's messages.
#[derive(Debug, Default)]
struct Times {
    /// Time from the stage's send time until the message was encoded, on the other host.
    encode: Timing,
    /// Transfer time from the other host to this host.
    network: Timing,
    /// Time until the message was decoded, on this host.
    decode: Timing,
    /// Total time, including publishing.
    all: Timing,
    n_bytes: u64,
    n_overtaken: u64,
}

/// The state of all hosts.
#[derive(Debug)]
pub(super) struct Report {
    file: PathBuf,
    text: Arc<Mutex<String>>,
    views: BTreeMap<usize, Times>,
    written: Option<Instant>,
    begin: Instant,
}

impl Report {
    pub(super) fn new(file: PathBuf) -> Self {
        Self {
            file,
            text: Arc::default(),
            views: BTreeMap::new(),
            written: None,
            begin: Instant::now(),
        }
    }

    /// Returns the newest text.
    pub(super) fn text(&self) -> Arc<Mutex<String>> {
        Arc::clone(&self.text)
    }

    /// Adds the durations of a published message.
    pub(super) fn took(&mut self, view: usize, it: &Arrived, clock: &Estimate) {
        let times = self.views.entry(view).or_default();
        let head = &it.head;
        let since = |later: u64, earlier: u64| later.saturating_sub(earlier);
        times.encode.add(since(head.packed_at_nanos, head.sent_at_nanos));
        times.network.add(since(it.came_at, clock.ours(head.packed_at_nanos)));
        times.decode.add(since(it.decoded_at, it.came_at));
        times.all.add(since(now_nanos(), clock.ours(head.sent_at_nanos)));
        times.n_bytes += it.n_bytes as u64;
        times.n_overtaken = head.n_overtaken;
    }

    pub(super) fn is_due(&self, every: Duration) -> bool {
        self.written.is_none_or(|at| at.elapsed() >= every)
    }

    /// Writes the state.
    ///
    /// * `views`: for every view of another host, its index, the index of its host, and its counts.
    pub(super) fn write(
        &mut self,
        remotes: &[Remote],
        views: &[(usize, usize, Tally)],
        is_last: bool,
    ) {
        self.written = Some(Instant::now());
        let hosts: Vec<Value> = remotes
            .iter()
            .enumerate()
            .map(|(index, remote)| {
                let own = views.iter().filter(|view| view.1 == index);
                self.host(remote, own.map(|view| (view.0, view.2)))
            })
            .collect();
        let seconds = self.begin.elapsed().as_secs_f64();
        let value =
            json!({ "schema_version": 1, "seconds": seconds, "over": is_last, "hosts": hosts });
        let text = format!("{value:#}\n");
        if let Err(error) = files::replace_unsynced(&self.file, text.as_bytes()) {
            tracing::debug!(%error, "cannot write the state of the hosts");
        }
        *self.text.lock().unwrap_or_else(PoisonError::into_inner) = text;
    }

    fn host(&self, remote: &Remote, views: impl Iterator<Item = (usize, Tally)>) -> Value {
        let now = now_nanos();
        let state = remote.state().clone();
        let clock = state.clock.estimate(now).map(|clock| {
            json!({
                "offset_ms": clock.offset_nanos as f64 * 1e-6,
                "drift_ppm": clock.drift_ppb * 1e-3,
                "bound_ms": clock.bound_nanos as f64 * 1e-6,
                "trip_ms": clock.trip_nanos as f64 * 1e-6,
                "exchanges": clock.n_exchanges,
                "resets": state.clock.n_resets(),
            })
        });
        let views: Vec<Value> = views.map(|(view, tally)| self.view(view, &tally)).collect();
        json!({
            "name": remote.name,
            "there": state.is_there(now),
            "refused": state.refused,
            "clock": clock,
            "packets": state.n_packets,
            "bytes": state.n_bytes,
            "malformed": state.n_malformed,
            "last_malformed": state.last_malformed,
            "unknown": state.n_unknown,
            "without_clock": state.n_without_clock,
            "no_room": state.n_no_room,
            "came": state.n_came,
            "went": state.n_went,
            "views": views,
        })
    }

    fn view(&self, view: usize, tally: &Tally) -> Value {
        let times = self.views.get(&view);
        let of = |pick: fn(&Times) -> &Timing| times.and_then(|time| pick(time).percentiles());
        json!({
            "view": view,
            "used": tally.n_used,
            "late": tally.n_late,
            "gone": tally.n_gone,
            "left_out": tally.n_left_out,
            "came_late": tally.n_came_late,
            "surplus": tally.n_surplus,
            "overtaken": times.map_or(0, |time| time.n_overtaken),
            "bytes": times.map_or(0, |time| time.n_bytes),
            "encode": of(|times| &times.encode),
            "network": of(|times| &times.network),
            "decode": of(|times| &times.decode),
            "all": of(|times| &times.all),
        })
    }
}
