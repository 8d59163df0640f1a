//! Checks the measurements of a scenario against its limits.

use exports::report::run::Limit;

use super::options::Limits;
use super::resources::ResourceUse;
use super::scenario::service_of;
use crate::spread::Spread;
use crate::trial::cost::Cost;
use crate::trial::injection::ProcessFault;
use crate::trial::limit::{at_least, at_most, none_of};

/// Longest time until a death is noticed, in milliseconds.
const NOTICE_MS: f64 = 1000.0;
/// Longest time by which a hang may be noticed after the hang limit, in milliseconds.
const LATE_MS: f64 = 1000.0;
/// Number of frames per kill that may be unaccounted for: the frame that the process was processing, and a frame that its last health
/// message did not yet count.
const MAX_UNACCOUNTED: u64 = 2;
/// Factor by which the use of a resource may grow during a run. A fixed amount may be added to it.
const GROWTH: f64 = 1.1;
const MORE_BYTES: f64 = 32e6;
const MORE_FILES: f64 = 8.0;

/// The part of a run's outcome that all scenarios have in common.
#[derive(Debug, Clone, Default)]
pub(super) struct RunOutcome {
    /// Reason why the run failed; `None` if it did not fail.
    pub failure: Option<String>,
    /// Number of results that were written.
    pub n_results: usize,
    /// Number of frames, over all views, that are unaccounted for.
    pub unanswered: u64,
    /// Processes that were given up, or were restarted more often than faults were injected into them.
    pub failed: Vec<String>,
    /// Names of the files left in shared memory.
    pub leftovers: Vec<String>,
    /// Cameras whose calibration is wrongly suspected.
    pub suspected: Vec<String>,
}

impl RunOutcome {
    /// Checks the limits that all scenarios have in common.
    ///
    /// * `n_kills`: the number of processes that were killed or made to hang.
    pub(super) fn judge(&self, n_kills: u64) -> Vec<Limit> {
        let failure: Vec<String> = self.failure.iter().cloned().collect();
        let unanswered = self.failure.is_none().then_some(self.unanswered as f64);
        vec![
            none_of("failures of the run", &failure),
            at_least("results", 1.0, Some(self.n_results as f64)),
            at_most(
                "frames unaccounted for",
                (MAX_UNACCOUNTED * n_kills) as f64,
                unanswered,
            ),
            none_of("other processes that failed", &self.failed),
            none_of("files left in shared memory", &self.leftovers),
            none_of("cameras wrongly reported as moved", &self.suspected),
        ]
    }
}

/// Checks a run with one fault of a process.
///
/// * `hang_ms`: time without heartbeats (for a stopped process) or without progress (for an endless loop) after which the
///   supervisor kills the process.
pub(super) fn once(
    requested: &Limits,
    fault: ProcessFault,
    process: &str,
    hang_ms: f64,
    (cost, outcome): (&Cost, &RunOutcome),
) -> Vec<Limit> {
    let (notice, patience) = match fault {
        ProcessFault::Kill => (NOTICE_MS, 0.0),
        ProcessFault::Stop | ProcessFault::Spin => (hang_ms + LATE_MS, hang_ms),
    };
    let back = requested.max_return_ms + patience;
    let pause = match service_of(process) {
        "capture" | "pose" | "quality" => requested.max_pause_ms,
        // While another process is missing, some or all results are missing.
        _ => back,
    };
    let mut limits = vec![
        at_most("time until noticed, ms", notice, cost.noticed_ms),
        at_most("time until back, ms", back, cost.back_ms),
        at_most(
            "longest pause between results, ms",
            pause,
            cost.longest_pause_ms,
        ),
    ];
    limits.extend(outcome.judge(1));
    limits
}

/// Measurements of a run with random kills.
#[derive(Debug, Clone, Default)]
pub(super) struct RandomKillsOutcome {
    /// Number of kills.
    pub n_kills: usize,
    /// Downtimes of the processes that worked again after a kill, in milliseconds; `None` if there are none.
    pub downtime_ms: Option<Spread>,
    /// Resources in use at the start and at the end; `None` if the run was too short.
    pub resources: Option<[ResourceUse; 2]>,
}

/// Checks a run with random kills.
pub(super) fn random(
    requested: &Limits,
    kills: &RandomKillsOutcome,
    outcome: &RunOutcome,
) -> Vec<Limit> {
    let mut limits = vec![
        at_least("kills", 1.0, Some(kills.n_kills as f64)),
        at_least(
            "kills with a recovery",
            kills.n_kills as f64,
            Some(kills.downtime_ms.map_or(0, |downtime_ms| downtime_ms.n) as f64),
        ),
        at_most(
            "time until back (p99), ms",
            requested.max_return_ms,
            kills.downtime_ms.map(|downtime_ms| downtime_ms.p99),
        ),
    ];
    limits.extend(outcome.judge(kills.n_kills as u64));
    if let Some([first, last]) = &kills.resources {
        let grown = |what: &str, number: fn(&ResourceUse) -> u64, more: f64, unit: f64| {
            let most = (GROWTH * number(first) as f64 + more) / unit;
            at_most(what, most.round(), Some(number(last) as f64 / unit))
        };
        limits.extend([
            grown(
                "final memory, MB",
                |used| used.memory_bytes,
                MORE_BYTES,
                1e6,
            ),
            grown(
                "final memory of the supervisor, MB",
                |used| used.supervisor_memory_bytes,
                MORE_BYTES,
                1e6,
            ),
            grown(
                "final shared memory, MB",
                |used| used.shared_bytes,
                MORE_BYTES,
                1e6,
            ),
            grown(
                "final number of descriptors",
                |used| used.descriptors,
                MORE_FILES,
                1.0,
            ),
            grown("final number of files", |used| used.files, MORE_FILES, 1.0),
        ]);
    }
    limits
}

/// Measurements of a run whose supervisor was killed, and of the next run.
#[derive(Debug, Clone, Default)]
pub(super) struct SupervisorKillOutcome {
    /// Time from the kill until the last process of the run had ended, in milliseconds; `None` if some processes did not end.
    pub ended_ms: Option<f64>,
    /// Number of files left for the next run to remove.
    pub files: u64,
    /// Time from the planning of the next run to its first result, in milliseconds.
    pub result_ms: Option<f64>,
}

/// Checks a run whose supervisor was killed, and the next run.
///
/// * `outcome`: the outcome of the next run.
pub(super) fn supervisor(
    requested: &Limits,
    killed: &SupervisorKillOutcome,
    outcome: &RunOutcome,
) -> Vec<Limit> {
    let mut limits = vec![
        at_most(
            "time until all processes of the killed run ended, ms",
            NOTICE_MS,
            killed.ended_ms,
        ),
        at_most(
            "time until the first result of the next run, ms",
            requested.max_return_ms,
            killed.result_ms,
        ),
    ];
    limits.extend(outcome.judge(0));
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Limits = Limits {
        max_return_ms: 8000.0,
        max_pause_ms: 2000.0,
    };

    fn good() -> (Cost, RunOutcome) {
        let cost = Cost {
            noticed_ms: Some(3.0),
            back_ms: Some(900.0),
            longest_pause_ms: Some(400.0),
            ..Cost::default()
        };
        let outcome = RunOutcome {
            n_results: 20,
            unanswered: 2,
            ..RunOutcome::default()
        };
        (cost, outcome)
    }

    fn missed(limits: Vec<Limit>) -> Vec<String> {
        let missed = limits.into_iter().filter(|limit| !limit.held);
        missed.map(|missed| missed.what).collect()
    }

    /// Returns the limits that a good run misses if `change` is applied to its measurements.
    fn missed_once(
        fault: ProcessFault,
        process: &str,
        change: impl FnOnce(&mut Cost, &mut RunOutcome),
    ) -> Vec<String> {
        let (mut cost, mut outcome) = good();
        change(&mut cost, &mut outcome);
        missed(once(&ASKED, fault, process, 3000.0, (&cost, &outcome)))
    }

    #[test]
    fn each_limit_of_a_process_fault_can_be_missed_separately() {
        type Change = fn(&mut Cost, &mut RunOutcome);
        let nothing: &[&str] = &[];
        let changes: [(Change, &[&str]); 11] = [
            (|_, _| (), nothing),
            (
                |cost, _| cost.noticed_ms = Some(1001.0),
                &["time until noticed, ms"],
            ),
            (
                |cost, _| cost.back_ms = Some(8001.0),
                &["time until back, ms"],
            ),
            (|cost, _| cost.back_ms = None, &["time until back, ms"]),
            (
                |cost, _| cost.longest_pause_ms = Some(2001.0),
                &["longest pause between results, ms"],
            ),
            (|_, outcome| outcome.n_results = 0, &["results"]),
            (
                |_, outcome| outcome.unanswered = 3,
                &["frames unaccounted for"],
            ),
            (
                |_, outcome| outcome.failed = vec!["pose-1".to_owned()],
                &["other processes that failed"],
            ),
            (
                |_, outcome| outcome.leftovers = vec!["px".to_owned()],
                &["files left in shared memory"],
            ),
            (
                |_, outcome| outcome.suspected = vec!["c1".to_owned()],
                &["cameras wrongly reported as moved"],
            ),
            (
                |_, outcome| outcome.failure = Some("it broke".to_owned()),
                &["failures of the run", "frames unaccounted for"],
            ),
        ];
        for (change, expected) in changes {
            assert_eq!(missed_once(ProcessFault::Kill, "pose-1", change), expected);
        }
    }

    #[test]
    fn limits_are_missed_if_no_fault_was_injected() {
        let got = missed_once(ProcessFault::Kill, "pose-1", |cost, _| {
            *cost = Cost::default();
        });
        assert_eq!(got.len(), 3, "{got:?}");
    }

    #[test]
    fn the_hang_limit_extends_the_limits_of_a_stopped_process_only() {
        let late = |cost: &mut Cost, _: &mut RunOutcome| {
            (cost.noticed_ms, cost.back_ms) = (Some(3100.0), Some(10_900.0));
        };
        assert_eq!(missed_once(ProcessFault::Stop, "pose-1", late), [""; 0]);
        let got = missed_once(ProcessFault::Kill, "pose-1", late);
        assert_eq!(got, ["time until noticed, ms", "time until back, ms"]);
    }

    #[test]
    fn the_pause_without_results_is_allowed_to_last_as_long_as_triangulate_is_absent() {
        let pause = |cost: &mut Cost, _: &mut RunOutcome| cost.longest_pause_ms = Some(2500.0);
        assert_eq!(
            missed_once(ProcessFault::Kill, "triangulate", pause),
            [""; 0]
        );
        assert_eq!(missed_once(ProcessFault::Kill, "capture-1", pause).len(), 1);
    }

    /// Returns the limits that a good run with random kills misses if a change is applied to its measurements.
    fn missed_random(
        change: impl FnOnce(&mut RandomKillsOutcome, &mut ResourceUse),
    ) -> Vec<String> {
        let first = ResourceUse {
            memory_bytes: 100_000_000,
            supervisor_memory_bytes: 10_000_000,
            descriptors: 100,
            files: 50,
            shared_bytes: 5_000_000,
        };
        let mut last = first;
        let mut kills = RandomKillsOutcome {
            n_kills: 3,
            downtime_ms: Spread::of(vec![500.0, 700.0, 900.0]),
            resources: None,
        };
        change(&mut kills, &mut last);
        kills.resources = Some([first, last]);
        missed(random(&ASKED, &kills, &good().1))
    }

    #[test]
    fn each_limit_of_random_kills_can_be_missed_separately() {
        type Change = fn(&mut RandomKillsOutcome, &mut ResourceUse);
        let nothing: &[&str] = &[];
        let changes: [(Change, &[&str]); 8] = [
            (|_, _| (), nothing),
            (|series, _| series.n_kills = 4, &["kills with a recovery"]),
            (
                |series, _| series.downtime_ms = Spread::of(vec![500.0, 700.0, 8001.0]),
                &["time until back (p99), ms"],
            ),
            (
                |_, used| used.memory_bytes = 143_000_000,
                &["final memory, MB"],
            ),
            (
                |_, used| used.supervisor_memory_bytes = 44_000_000,
                &["final memory of the supervisor, MB"],
            ),
            (
                |_, used| used.shared_bytes = 39_000_000,
                &["final shared memory, MB"],
            ),
            (
                |_, used| used.descriptors = 119,
                &["final number of descriptors"],
            ),
            (|_, used| used.files = 64, &["final number of files"]),
        ];
        for (change, expected) in changes {
            assert_eq!(missed_random(change), expected);
        }
        let none = random(&ASKED, &RandomKillsOutcome::default(), &good().1);
        let expected = [
            "kills",
            "time until back (p99), ms",
            "frames unaccounted for",
        ];
        assert_eq!(missed(none), expected, "nobody was killed");
    }

    #[test]
    fn orphaned_processes_must_end_and_the_next_run_must_work() {
        let good_one = SupervisorKillOutcome {
            ended_ms: Some(40.0),
            files: 90,
            result_ms: Some(900.0),
        };
        let outcome = RunOutcome {
            unanswered: 0,
            ..good().1
        };
        let judge = |supervisor_kill_outcome: &SupervisorKillOutcome| {
            missed(supervisor(&ASKED, supervisor_kill_outcome, &outcome))
        };
        assert_eq!(judge(&good_one), [""; 0]);
        let orphans = SupervisorKillOutcome {
            ended_ms: None,
            ..good_one.clone()
        };
        assert_eq!(
            judge(&orphans),
            ["time until all processes of the killed run ended, ms"]
        );
        let broken = SupervisorKillOutcome {
            result_ms: None,
            ..good_one
        };
        assert_eq!(
            judge(&broken),
            ["time until the first result of the next run, ms"]
        );
    }
}
