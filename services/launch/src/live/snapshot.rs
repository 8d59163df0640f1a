//! The state of all processes of a deployment at one time, and their last metrics.

use std::collections::BTreeMap;

use runtime::ObservedProcess;
use runtime::metrics::{Reading, ReadingError};

use crate::resolved::SERVICES;

/// A running process that sends no metrics for this time, in nanoseconds, counts as silent. Processes send metrics every second.
const SILENT_NANOS: u64 = 5_000_000_000;

/// The state of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The process is alive and sends metrics.
    Running,
    /// The process has received the end of the stream, and sent it on.
    Done,
    /// The process is alive, but has not sent metrics since its last start.
    Starting,
    /// The process is alive, but has not sent metrics for several seconds.
    Silent,
    /// The process is not running. The supervisor may restart it.
    Dead,
}

impl State {
    /// Returns the name of the state for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::Running => "runs",
            Self::Done => "done",
            Self::Starting => "begins",
            Self::Silent => "silent",
            Self::Dead => "dead",
        }
    }
}

/// One process at the time of the snapshot.
#[derive(Debug, Clone)]
pub struct ProcessSnapshot {
    /// Name of the process in the deployment.
    pub name: String,
    /// Process id, while the process is alive.
    pub pid: Option<u32>,
    /// State of the process.
    pub state: State,
    /// Last metrics of the process, if they are valid. They are kept after its death.
    pub reading: Option<Reading>,
    /// Reason why the last metrics are invalid.
    pub problem: Option<ReadingError>,
    /// Age of the last metrics, in nanoseconds.
    pub age_nanos: u64,
}

/// All processes of a deployment at one time.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Name of the deployment.
    pub name: String,
    /// Process id of the supervisor.
    pub supervisor: u32,
    /// Processes of the deployment, in pipeline order.
    pub processes: Vec<ProcessSnapshot>,
}

impl Snapshot {
    pub(super) fn new(
        name: &str,
        supervisor: u32,
        observed: &[ObservedProcess<'_>],
        now: u64,
    ) -> Self {
        let mut processes: Vec<ProcessSnapshot> =
            observed.iter().map(|observed| ProcessSnapshot::new(observed, now)).collect();
        processes.sort_by_key(|process| sort_key(&process.name));
        Self {
            name: name.to_owned(),
            supervisor,
            processes,
        }
    }

    /// Returns the names of the views that occur in the metrics.
    pub fn views(&self) -> BTreeMap<usize, &str> {
        let readings = self.processes.iter().filter_map(|process| process.reading.as_ref());
        readings
            .filter_map(|reading| reading.view.as_ref())
            .filter(|view| !view.name.is_empty())
            .map(|view| (view.index, view.name.as_str()))
            .collect()
    }

    /// Returns true if every live process has sent metrics.
    pub(super) fn is_complete(&self) -> bool {
        let is_starting =
            |process_snapshot: &ProcessSnapshot| process_snapshot.state == State::Starting;
        !self.processes.iter().any(is_starting)
    }
}

impl ProcessSnapshot {
    fn new(observed: &ObservedProcess<'_>, now: u64) -> Self {
        let read = observed.metrics.map(Reading::from_message);
        let age_nanos = observed.metrics.map_or(0, |metric| now.saturating_sub(metric.at_nanos));
        let (reading, problem) = match read {
            None => (None, None),
            Some(Ok(reading)) => (Some(reading), None),
            Some(Err(problem)) => (None, Some(problem)),
        };
        let current = reading.as_ref().filter(|reading| observed.pid == Some(reading.pid));
        let state = match (observed.pid, current) {
            (None, _) => State::Dead,
            (Some(_), None) if problem.is_none() => State::Starting,
            _ if age_nanos > SILENT_NANOS => State::Silent,
            (_, Some(reading)) if reading.is_finished => State::Done,
            _ => State::Running,
        };
        Self {
            name: observed.process.to_owned(),
            pid: observed.pid,
            state,
            reading,
            problem,
            age_nanos,
        }
    }
}

/// Returns the sort key of a process: position of its service in the pipeline, index, name.
fn sort_key(process: &str) -> (usize, usize, String) {
    let (service, index) = process.split_once('-').unwrap_or((process, "0"));
    let nth = SERVICES.iter().position(|name| *name == service);
    let index = index.parse().unwrap_or(usize::MAX);
    (nth.unwrap_or(SERVICES.len()), index, process.to_owned())
}

#[cfg(test)]
pub(crate) mod tests {
    use messages::{Cause, Span};
    use runtime::metrics::{Meter, Passage};

    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// Returns metrics sent at 10 s by a process that was started at 4 s.
    pub(crate) fn metrics_of(pid: u32, view: Option<usize>) -> messages::Metrics {
        let mut meter = Meter::default();
        if let Some(view) = view {
            meter.belongs_to(view, ["left", "right"][view]);
        }
        for nth in 1..=100 {
            meter.passed(&Passage {
                waiting: Some(60_000),
                computing: nth * 1_000_000,
                publishing: 2_500,
                since_capture: None,
            });
        }
        meter.spent(Span::WAITING, Some(1), 3 * SECOND);
        meter.dropped(Cause::Late, 3);
        meter.queued(2);
        let mut sent = messages::Metrics {
            pid,
            epoch: 1,
            n_sent: 100,
            sent_millihertz: 19_960,
            at_nanos: 10 * SECOND,
            began_at_nanos: 4 * SECOND,
            memory_bytes: 48_200_000,
            peak_memory_bytes: 50_000_000,
            evidence_bytes: 7_350_000,
            ..meter.head()
        };
        for index in 0..meter.n_rows() {
            sent.rows[index] = meter.row(index).unwrap();
            sent.rows[index].millihertz = 19_960;
        }
        sent.n_rows = meter.n_rows() as u32;
        sent
    }

    /// Returns a snapshot at 11 s: two processes are running, one is dead, one is starting.
    pub(crate) fn snapshot() -> Snapshot {
        let (pose, record) = (metrics_of(17, Some(0)), metrics_of(18, None));
        let observed_process = |process, pid, metrics| ObservedProcess {
            process,
            pid,
            metrics,
        };
        let observed = [
            observed_process("capture-10", None, None),
            observed_process("capture-9", Some(4), None),
            observed_process("pose-0", Some(17), Some(&pose)),
            observed_process("results", Some(18), Some(&record)),
        ];
        Snapshot::new("walk", 3, &observed, 11 * SECOND)
    }

    fn state(pid: Option<u32>, metrics: Option<&messages::Metrics>, now: u64) -> State {
        let process = "pose-0";
        ProcessSnapshot::new(
            &ObservedProcess {
                process,
                pid,
                metrics,
            },
            now,
        )
        .state
    }

    #[test]
    fn processes_are_sorted_by_pipeline_order_and_index() {
        let names: Vec<String> =
            snapshot().processes.into_iter().map(|process| process.name).collect();
        assert_eq!(names, ["capture-9", "capture-10", "pose-0", "results"]);
    }

    #[test]
    fn a_live_process_with_metrics_is_shown_as_running_until_it_has_finished() {
        let mut metrics = metrics_of(17, None);
        let now = 11 * SECOND;
        assert_eq!(state(Some(17), Some(&metrics), now), State::Running);
        metrics.finished = 1;
        assert_eq!(state(Some(17), Some(&metrics), now), State::Done);
    }

    #[test]
    fn a_process_that_is_not_alive_is_shown_as_dead_despite_its_metrics() {
        let metrics = metrics_of(17, None);
        assert_eq!(state(None, Some(&metrics), 11 * SECOND), State::Dead);
        assert_eq!(state(None, None, 11 * SECOND), State::Dead);
    }

    #[test]
    fn metrics_from_before_a_restart_are_ignored() {
        let metrics = metrics_of(16, None);
        assert_eq!(
            state(Some(17), Some(&metrics), 11 * SECOND),
            State::Starting
        );
        assert_eq!(state(Some(17), None, 11 * SECOND), State::Starting);
    }

    #[test]
    fn a_process_without_metrics_for_five_seconds_is_shown_as_silent() {
        let metrics = metrics_of(17, None);
        assert_eq!(state(Some(17), Some(&metrics), 15 * SECOND), State::Running);
        assert_eq!(state(Some(17), Some(&metrics), 16 * SECOND), State::Silent);
    }

    #[test]
    fn invalid_metrics_are_reported() {
        let mut metrics = metrics_of(17, None);
        metrics.n_rows = 1000;
        let process = "pose-0";
        let observed_process = ObservedProcess {
            process,
            pid: Some(17),
            metrics: Some(&metrics),
        };
        let process = ProcessSnapshot::new(&observed_process, 11 * SECOND);
        assert_eq!(
            process.problem,
            Some(ReadingError::TooManyRows { rows: 1000 })
        );
        assert!(process.reading.is_none());
    }

    #[test]
    fn the_names_of_views_come_from_the_metrics() {
        assert_eq!(snapshot().views(), [(0, "left")].into());
    }
}
