//! What must hold when a process is struck: numbers in, verdicts out.

use report::run::Limit;

use super::census::Sample;
use super::options::Limits;
use super::scenario::service_of;
use crate::spread::Spread;
use crate::trial::cost::Cost;
use crate::trial::limit::{at_least, at_most, none_of};
use crate::trial::strike::Blow;

/// A death must be noticed within, milliseconds.
const NOTICE_MS: f64 = 1000.0;
/// How much later than its limit a hang may be noticed, milliseconds.
const LATE_MS: f64 = 1000.0;
/// Frames that every kill may cost without anybody knowing: what the process held, and what its last report may not
/// have counted.
const HELD: u64 = 2;
/// What may be more at the end than at first: share of it, and so much on top.
const GROWTH: f64 = 1.1;
const MORE_BYTES: f64 = 32e6;
const MORE_FILES: f64 = 8.0;

/// What is left of a run that is over.
#[derive(Debug, Clone, Default)]
pub(super) struct Aftermath {
    /// Why it did not end by itself, if it did not.
    pub failure: Option<String>,
    /// Results that were written.
    pub n_results: usize,
    /// Frames of all views whose end is not known.
    pub unanswered: u64,
    /// Processes that ended more often than they were struck, or were given up.
    pub failed: Vec<String>,
    /// What is left in shared memory.
    pub left: Vec<String>,
    /// Cameras that are said not to stand where the calibration says, but for one that does not.
    pub accused: Vec<String>,
}

impl Aftermath {
    /// What must hold however a run went.
    ///
    /// * `n_kills`: processes that were struck.
    pub(super) fn judge(&self, n_kills: u64) -> Vec<Limit> {
        let failure: Vec<String> = self.failure.iter().cloned().collect();
        let unanswered = self.failure.is_none().then_some(self.unanswered as f64);
        vec![
            none_of("failures of the run", &failure),
            at_least("results", 1.0, Some(self.n_results as f64)),
            at_most(
                "frames whose end is not known",
                (HELD * n_kills) as f64,
                unanswered,
            ),
            none_of("processes that failed by themselves", &self.failed),
            none_of("left in shared memory", &self.left),
            none_of(
                "cameras accused that stand where they should",
                &self.accused,
            ),
        ]
    }
}

/// Judges a run one process of which was struck once.
///
/// * `hang_ms`: how long a stopped process may give no sign of life, or a spinning one of work, before the supervisor
///   ends it.
pub(super) fn once(
    asked: &Limits,
    blow: Blow,
    process: &str,
    hang_ms: f64,
    (cost, after): (&Cost, &Aftermath),
) -> Vec<Limit> {
    let (notice, patience) = match blow {
        Blow::Kill => (NOTICE_MS, 0.0),
        Blow::Stop | Blow::Spin => (hang_ms + LATE_MS, hang_ms),
    };
    let back = asked.max_return_ms + patience;
    let pause = match service_of(process) {
        "capture" | "pose" | "quality" => asked.max_pause_ms,
        // Without these there is no result, or none of some pairs, or none that is written.
        _ => back,
    };
    let mut limits = vec![
        at_most("noticed after, ms", notice, cost.noticed_ms),
        at_most("back after, ms", back, cost.back_ms),
        at_most(
            "longest pause of results meanwhile, ms",
            pause,
            cost.longest_pause_ms,
        ),
    ];
    limits.extend(after.judge(1));
    limits
}

/// What became of a run in which one process after the other was killed.
#[derive(Debug, Clone, Default)]
pub(super) struct Barraged {
    /// Kills.
    pub n_kills: usize,
    /// How long those were away who came back, milliseconds; none if nobody did.
    pub away_ms: Option<Spread>,
    /// What all held at first and at last, if the run was long enough to say.
    pub held: Option<[Sample; 2]>,
}

/// Judges a run in which one process after the other was killed.
pub(super) fn random(asked: &Limits, it: &Barraged, after: &Aftermath) -> Vec<Limit> {
    let mut limits = vec![
        at_least("kills", 1.0, Some(it.n_kills as f64)),
        at_least(
            "came back",
            it.n_kills as f64,
            Some(it.away_ms.map_or(0, |it| it.n) as f64),
        ),
        at_most(
            "back after (p99), ms",
            asked.max_return_ms,
            it.away_ms.map(|it| it.p99),
        ),
    ];
    limits.extend(after.judge(it.n_kills as u64));
    if let Some([first, last]) = &it.held {
        let grown = |what: &str, number: fn(&Sample) -> u64, more: f64, unit: f64| {
            let most = (GROWTH * number(first) as f64 + more) / unit;
            at_most(what, most.round(), Some(number(last) as f64 / unit))
        };
        limits.extend([
            grown("memory at last, MB", |it| it.memory_bytes, MORE_BYTES, 1e6),
            grown(
                "memory of the supervisor at last, MB",
                |it| it.supervisor_memory_bytes,
                MORE_BYTES,
                1e6,
            ),
            grown(
                "shared memory at last, MB",
                |it| it.shared_bytes,
                MORE_BYTES,
                1e6,
            ),
            grown("descriptors at last", |it| it.descriptors, MORE_FILES, 1.0),
            grown("files at last", |it| it.files, MORE_FILES, 1.0),
        ]);
    }
    limits
}

/// What became of a run whose supervisor was killed, and of the next one.
#[derive(Debug, Clone, Default)]
pub(super) struct Orphaned {
    /// When the last of its processes was gone, milliseconds after the kill.
    pub ended_ms: Option<f64>,
    /// Files that were left for the next one.
    pub files: u64,
    /// When the next one had its first result, milliseconds after it was planned.
    pub result_ms: Option<f64>,
}

/// Judges a run whose supervisor was killed, and the next one.
///
/// * `after`: of the next one.
pub(super) fn supervisor(asked: &Limits, it: &Orphaned, after: &Aftermath) -> Vec<Limit> {
    let mut limits = vec![
        at_most("its processes ended after, ms", NOTICE_MS, it.ended_ms),
        at_most(
            "first result of the next run after, ms",
            asked.max_return_ms,
            it.result_ms,
        ),
    ];
    limits.extend(after.judge(0));
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Limits = Limits {
        max_return_ms: 8000.0,
        max_pause_ms: 2000.0,
    };

    fn good() -> (Cost, Aftermath) {
        let cost = Cost {
            noticed_ms: Some(3.0),
            back_ms: Some(900.0),
            longest_pause_ms: Some(400.0),
            ..Cost::default()
        };
        let after = Aftermath {
            n_results: 20,
            unanswered: 2,
            ..Aftermath::default()
        };
        (cost, after)
    }

    fn missed(limits: Vec<Limit>) -> Vec<String> {
        let missed = limits.into_iter().filter(|it| !it.held);
        missed.map(|it| it.what).collect()
    }

    /// What a run misses that was good but for a change.
    fn missed_once(
        blow: Blow,
        process: &str,
        change: impl FnOnce(&mut Cost, &mut Aftermath),
    ) -> Vec<String> {
        let (mut cost, mut after) = good();
        change(&mut cost, &mut after);
        missed(once(&ASKED, blow, process, 3000.0, (&cost, &after)))
    }

    #[test]
    fn every_limit_of_a_struck_process_can_be_missed_alone() {
        type Change = fn(&mut Cost, &mut Aftermath);
        let nothing: &[&str] = &[];
        let changes: [(Change, &[&str]); 11] = [
            (|_, _| (), nothing),
            (|it, _| it.noticed_ms = Some(1001.0), &["noticed after, ms"]),
            (|it, _| it.back_ms = Some(8001.0), &["back after, ms"]),
            (|it, _| it.back_ms = None, &["back after, ms"]),
            (
                |it, _| it.longest_pause_ms = Some(2001.0),
                &["longest pause of results meanwhile, ms"],
            ),
            (|_, it| it.n_results = 0, &["results"]),
            (
                |_, it| it.unanswered = 3,
                &["frames whose end is not known"],
            ),
            (
                |_, it| it.failed = vec!["pose-1".to_owned()],
                &["processes that failed by themselves"],
            ),
            (
                |_, it| it.left = vec!["px".to_owned()],
                &["left in shared memory"],
            ),
            (
                |_, it| it.accused = vec!["c1".to_owned()],
                &["cameras accused that stand where they should"],
            ),
            (
                |_, it| it.failure = Some("it broke".to_owned()),
                &["failures of the run", "frames whose end is not known"],
            ),
        ];
        for (change, expected) in changes {
            assert_eq!(missed_once(Blow::Kill, "pose-1", change), expected);
        }
    }

    #[test]
    fn a_process_that_was_never_struck_has_held_nothing() {
        let got = missed_once(Blow::Kill, "pose-1", |it, _| *it = Cost::default());
        assert_eq!(got.len(), 3, "{got:?}");
    }

    #[test]
    fn a_hang_may_be_noticed_late_but_the_others_go_on() {
        let late = |it: &mut Cost, _: &mut Aftermath| {
            (it.noticed_ms, it.back_ms) = (Some(3100.0), Some(10_900.0));
        };
        assert_eq!(missed_once(Blow::Stop, "pose-1", late), [""; 0]);
        let got = missed_once(Blow::Kill, "pose-1", late);
        assert_eq!(got, ["noticed after, ms", "back after, ms"]);
    }

    #[test]
    fn who_makes_all_results_may_be_missed_for_as_long_as_it_is_away() {
        let pause = |it: &mut Cost, _: &mut Aftermath| it.longest_pause_ms = Some(2500.0);
        assert_eq!(missed_once(Blow::Kill, "triangulate", pause), [""; 0]);
        assert_eq!(missed_once(Blow::Kill, "capture-1", pause).len(), 1);
    }

    /// What a barrage misses that was good but for a change.
    fn missed_random(change: impl FnOnce(&mut Barraged, &mut Sample)) -> Vec<String> {
        let first = Sample {
            memory_bytes: 100_000_000,
            supervisor_memory_bytes: 10_000_000,
            descriptors: 100,
            files: 50,
            shared_bytes: 5_000_000,
        };
        let mut last = first;
        let mut it = Barraged {
            n_kills: 3,
            away_ms: Spread::of(vec![500.0, 700.0, 900.0]),
            held: None,
        };
        change(&mut it, &mut last);
        it.held = Some([first, last]);
        missed(random(&ASKED, &it, &good().1))
    }

    #[test]
    fn every_limit_of_a_barrage_can_be_missed_alone() {
        type Change = fn(&mut Barraged, &mut Sample);
        let nothing: &[&str] = &[];
        let changes: [(Change, &[&str]); 8] = [
            (|_, _| (), nothing),
            (|it, _| it.n_kills = 4, &["came back"]),
            (
                |it, _| it.away_ms = Spread::of(vec![500.0, 700.0, 8001.0]),
                &["back after (p99), ms"],
            ),
            (
                |_, it| it.memory_bytes = 143_000_000,
                &["memory at last, MB"],
            ),
            (
                |_, it| it.supervisor_memory_bytes = 44_000_000,
                &["memory of the supervisor at last, MB"],
            ),
            (
                |_, it| it.shared_bytes = 39_000_000,
                &["shared memory at last, MB"],
            ),
            (|_, it| it.descriptors = 119, &["descriptors at last"]),
            (|_, it| it.files = 64, &["files at last"]),
        ];
        for (change, expected) in changes {
            assert_eq!(missed_random(change), expected);
        }
        let none = random(&ASKED, &Barraged::default(), &good().1);
        let expected = [
            "kills",
            "back after (p99), ms",
            "frames whose end is not known",
        ];
        assert_eq!(missed(none), expected, "nobody was killed");
    }

    #[test]
    fn orphans_must_end_and_the_next_run_must_work() {
        let good_one = Orphaned {
            ended_ms: Some(40.0),
            files: 90,
            result_ms: Some(900.0),
        };
        let after = Aftermath {
            unanswered: 0,
            ..good().1
        };
        let judge = |it: &Orphaned| missed(supervisor(&ASKED, it, &after));
        assert_eq!(judge(&good_one), [""; 0]);
        let orphans = Orphaned {
            ended_ms: None,
            ..good_one.clone()
        };
        assert_eq!(judge(&orphans), ["its processes ended after, ms"]);
        let broken = Orphaned {
            result_ms: None,
            ..good_one
        };
        assert_eq!(judge(&broken), ["first result of the next run after, ms"]);
    }
}
