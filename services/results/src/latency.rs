//! Measures how much time goes into computation, waiting and transport, from the stamps in the messages.

use std::collections::BTreeMap;

use hdrhistogram::{CreationError, Histogram};
use messages::{Status, Timing};
use runfiles::{LatencyReport, Percentiles};

use crate::FrameRecord;

/// Longest duration that the histograms resolve, in microseconds: an hour.
const LONGEST_MICROS: u64 = 3_600_000_000;

/// Collects durations frame by frame.
///
/// Each hop (the way of a message from one process to the next) has two parts. Waiting is the time in which the receiver was still busy: it
/// sent its previous message after this message was sent. The rest of the hop is transport. The path of a frame is followed backwards from
/// the result: to the pair of views that was received last, then to the view whose pose was received last.
#[derive(Debug)]
pub struct Latency {
    histograms: BTreeMap<(Kind, &'static str), Histogram<u32>>,
    /// Time of the last message of every process, by stage and number.
    sent: BTreeMap<(&'static str, usize), u64>,
    n_workers: usize,
    total: Total,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Stage,
    Transport,
    Waiting,
    EndToEnd,
}

#[derive(Debug, Clone, Copy, Default)]
struct Total {
    end_to_end: u64,
    computation: u64,
    transport: u64,
    waiting: u64,
}

const STAGES: [&str; 5] = ["capture", "pose", "quality", "fuse", "triangulate"];
const HOPS: [&str; 3] = ["capture to pose", "pose to fuse", "fuse to triangulate"];

impl Latency {
    /// Starts without durations.
    ///
    /// * `n_workers`: number of fusion processes, to which pairs are assigned in turn.
    ///
    /// # Errors
    ///
    /// Fails if the bounds of the histograms are wrong. They are constants, so this does not happen.
    pub fn new(n_workers: usize) -> Result<Self, CreationError> {
        let stages = STAGES.map(|stage| (Kind::Stage, stage));
        let transport = HOPS.map(|hop| (Kind::Transport, hop));
        let waiting = HOPS.map(|hop| (Kind::Waiting, hop));
        let mut histograms = BTreeMap::new();
        for key in stages.into_iter().chain(transport).chain(waiting).chain([(Kind::EndToEnd, "")])
        {
            histograms.insert(key, Histogram::new_with_bounds(1, LONGEST_MICROS, 3)?);
        }
        Ok(Self {
            histograms,
            sent: BTreeMap::new(),
            n_workers: n_workers.max(1),
            total: Total::default(),
        })
    }

    /// Adds a frame.
    pub fn add(&mut self, record: &FrameRecord) {
        for view in &record.views {
            let timings = [
                (
                    "capture",
                    view.frame.filter(|frame| frame.status == Status::OK).map(|frame| frame.timing),
                ),
                (
                    "pose",
                    view.pose.filter(|pose| pose.status == Status::OK).map(|pose| pose.timing),
                ),
                ("quality", view.quality.map(|quality| quality.timing)),
            ];
            for (stage, timing) in timings {
                if let Some(timing) = timing {
                    self.note(Kind::Stage, stage, computation(timing));
                }
            }
        }
        for pair in record.fused.iter().filter(|fused| fused.status == Status::OK) {
            self.note(Kind::Stage, "fuse", computation(pair.timing));
        }
        if record.skeletons.status == Status::OK {
            let timing = record.skeletons.timing;
            self.note(Kind::Stage, "triangulate", computation(timing));
            self.walk(record);
        }
        self.remember(record);
    }

    /// Follows the path of a frame, from the result back to its capture.
    fn walk(&mut self, record: &FrameRecord) -> Option<()> {
        let result = record.skeletons.timing;
        let pair = record.fused.iter().max_by_key(|pair| pair.timing.sent_at_nanos)?;
        let view = (0..record.views.len())
            .filter(|i| record.views[*i].pose.is_some())
            .max_by_key(|i| record.views[*i].pose.map(|pose| pose.timing.sent_at_nanos))?;
        let pose = record.views[view].pose?.timing;
        let frame = record.views[view].frame?.timing;
        let worker = pair.index % self.n_workers;
        // The same worker may have sent another pair of this frame just before.
        let same_worker = record.fused.iter().filter(|fused| {
            fused.index % self.n_workers == worker
                && fused.timing.sent_at_nanos <= pair.timing.received_at_nanos
        });
        let busy = same_worker.map(|same_worker| same_worker.timing.sent_at_nanos).max();
        let busy = busy.max(self.sent.get(&("fuse", worker)).copied());
        self.hop(
            HOPS[2],
            pair.timing,
            result,
            self.sent.get(&("triangulate", 0)).copied(),
        );
        self.hop(HOPS[1], pose, pair.timing, busy);
        self.hop(
            HOPS[0],
            frame,
            pose,
            self.sent.get(&("pose", view)).copied(),
        );
        let captured = record.skeletons.stamp.captured_at_nanos.min(frame.received_at_nanos);
        let end_to_end = result.sent_at_nanos.saturating_sub(captured);
        self.note(Kind::EndToEnd, "", end_to_end);
        self.total.end_to_end += end_to_end;
        self.total.computation +=
            [frame, pose, pair.timing, result].map(computation).iter().sum::<u64>();
        Some(())
    }

    fn hop(&mut self, name: &'static str, from: Timing, to: Timing, busy_until: Option<u64>) {
        let (sent, received) = (from.sent_at_nanos, to.received_at_nanos);
        let free = busy_until.unwrap_or(0).clamp(sent, received.max(sent));
        let (waiting, transport) = (free - sent, received.saturating_sub(free));
        self.note(Kind::Waiting, name, waiting);
        self.note(Kind::Transport, name, transport);
        self.total.waiting += waiting;
        self.total.transport += transport;
    }

    fn remember(&mut self, record: &FrameRecord) {
        for (view, it) in record.views.iter().enumerate() {
            if let Some(pose) = it.pose {
                self.sent.insert(("pose", view), pose.timing.sent_at_nanos);
            }
        }
        for pair in &record.fused {
            let worker = pair.index % self.n_workers;
            let last = self.sent.entry(("fuse", worker)).or_default();
            *last = pair.timing.sent_at_nanos.max(*last);
        }
        let sent = record.skeletons.timing.sent_at_nanos;
        self.sent.insert(("triangulate", 0), sent);
    }

    fn note(&mut self, kind: Kind, name: &'static str, nanos: u64) {
        if let Some(histogram) = self.histograms.get_mut(&(kind, name)) {
            histogram.saturating_record(nanos / 1000);
        }
    }

    /// Returns the report about the frames so far.
    pub fn report(&self) -> LatencyReport {
        let of = |kind| {
            let those = self.histograms.iter().filter(move |histogram| histogram.0.0 == kind);
            those
                .filter(|those| !those.1.is_empty())
                .map(|(key, histogram)| (key.1.to_owned(), percentiles(histogram)))
                .collect::<BTreeMap<_, _>>()
        };
        let whole = self.total.end_to_end as f64;
        let share = |nanos: u64| (whole > 0.0).then(|| nanos as f64 / whole);
        LatencyReport {
            stages: of(Kind::Stage),
            transport: of(Kind::Transport),
            waiting: of(Kind::Waiting),
            end_to_end: of(Kind::EndToEnd).remove("").unwrap_or_default(),
            share_not_computation: share(self.total.computation).map(|value| 1.0 - value),
            share_transport: share(self.total.transport),
            share_waiting: share(self.total.waiting),
        }
    }
}

fn computation(timing: Timing) -> u64 {
    timing.sent_at_nanos.saturating_sub(timing.received_at_nanos)
}

fn percentiles(histogram: &Histogram<u32>) -> Percentiles {
    let ms = |micros: u64| micros as f64 / 1000.0;
    Percentiles {
        count: histogram.len(),
        p50_ms: ms(histogram.value_at_quantile(0.5)),
        p99_ms: ms(histogram.value_at_quantile(0.99)),
        p99_9_ms: ms(histogram.value_at_quantile(0.999)),
        max_ms: ms(histogram.max()),
    }
}

#[cfg(test)]
mod tests {
    use messages::{FrameHeader, PairPose};

    use super::*;
    use crate::FusedRecord;
    use crate::testing::record;

    const MS: u64 = 1_000_000;

    fn timing(received_ms: u64, sent_ms: u64) -> Timing {
        Timing {
            received_at_nanos: received_ms * MS,
            sent_at_nanos: sent_ms * MS,
        }
    }

    /// A frame on its path: capture 10..20, pose 22..52, fuse 53..73, triangulate 75..80.
    fn timed(frame: u64, start_ms: u64) -> FrameRecord {
        let mut it = record(frame);
        for view in &mut it.views {
            view.frame = Some(FrameHeader {
                timing: timing(start_ms + 10, start_ms + 20),
                ..FrameHeader::default()
            });
            if let Some(pose) = &mut view.pose {
                pose.timing = timing(start_ms + 22, start_ms + 52);
            }
        }
        it.fused = vec![FusedRecord::from(&PairPose {
            timing: timing(start_ms + 53, start_ms + 73),
            ..PairPose::default()
        })];
        it.skeletons.stamp.captured_at_nanos = (start_ms + 10) * MS;
        it.skeletons.timing = timing(start_ms + 75, start_ms + 80);
        it
    }

    fn near(got: f64, expected: f64) {
        assert!(
            (got - expected).abs() < 0.01 * expected.abs() + 1e-9,
            "{got} {expected}"
        );
    }

    #[test]
    fn computation_and_transport_add_up_to_the_total_latency() {
        let mut latency = Latency::new(1).unwrap();
        latency.add(&timed(0, 0));
        let got = latency.report();
        near(got.end_to_end.p50_ms, 70.0);
        near(got.stages["pose"].p50_ms, 30.0);
        near(got.share_not_computation.unwrap(), 5.0 / 70.0);
        near(got.share_transport.unwrap(), 5.0 / 70.0);
        assert_eq!(got.share_waiting.unwrap(), 0.0);
    }

    #[test]
    fn time_spent_behind_a_busy_process_counts_as_waiting() {
        let mut latency = Latency::new(1).unwrap();
        latency.add(&timed(0, 0));
        // The pose process is busy until 52. Frame 1 was sent at 30 and received at 54.
        let mut second = timed(1, 32);
        for view in &mut second.views {
            if let Some(frame) = &mut view.frame {
                frame.timing = timing(25, 30);
            }
        }
        second.skeletons.stamp.captured_at_nanos = 25 * MS;
        latency.add(&second);
        let got = latency.report();
        near(got.waiting["capture to pose"].max_ms, 22.0);
        near(got.transport["capture to pose"].max_ms, 2.0);
    }

    #[test]
    fn a_frame_without_a_result_has_no_end_to_end_time() {
        let mut latency = Latency::new(1).unwrap();
        let mut it = timed(0, 0);
        it.skeletons.status = Status::TOO_FEW_VIEWS;
        latency.add(&it);
        let got = latency.report();
        assert_eq!(got.end_to_end.count, 0);
        assert_eq!(got.share_not_computation, None);
        assert_eq!(got.stages["pose"].count, 2);
    }
}
