//! Checks the limits of the demo.

use exports::report::run::Limit;
use launch::ViewReport;

use super::options::Limits;
use super::score::Score;
use crate::trial::cost::Cost;
use crate::trial::limit::{at_least, at_most, none_of};

/// Number of frames per kill that may be unaccounted for: the frame that the process was processing, and a frame that its last health
/// message did not yet count.
const MAX_UNACCOUNTED: u64 = 2;

/// The measurements of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured<'a> {
    /// Number of frames that each camera should capture.
    pub n_frames: u64,
    /// Number of results, and number of results with a skeleton.
    pub n_results: [usize; 2],
    /// Accuracy of the results.
    pub score: &'a Score,
    /// Effects of the kill; `None` if no kill was planned.
    pub cost: Option<&'a Cost>,
    /// Time that a stage waits for a late view, in milliseconds.
    pub deadline_ms: f64,
    /// Computing time relative to a machine that can process 5 frames per second, at least 1.
    pub slowness: f64,
    /// Interval between frames relative to the interval at 5 frames per second, at least 1.
    pub spread: f64,
    /// Frame counts of every view.
    pub views: &'a [ViewReport],
    /// Processes that ended unexpectedly, except the killed one.
    pub failed: &'a [String],
    /// Number of results that were not written; `None` if unknown.
    pub n_unwritten: Option<u64>,
}

/// Checks a run.
pub(super) fn judge(requested: &Limits, measured: &Measured<'_>) -> Vec<Limit> {
    let [results, skeletons] = measured.n_results;
    let mut limits = vec![
        at_least(
            "frames with a result, %",
            requested.min_results,
            share(results, measured.n_frames as usize),
        ),
        at_least(
            "results with a skeleton, %",
            requested.min_skeletons,
            share(skeletons, results),
        ),
        at_least(
            "PCP3D at 0.5, %",
            requested.min_pcp3d,
            measured.score.pcp3d_percent,
        ),
    ];
    if let Some(cost) = measured.cost {
        let results = cost.killed_at_ms.map(|_| cost.results_without_it as f64);
        let needs_results = needs_results_meanwhile(cost, measured.deadline_ms);
        limits.extend([
            at_most(
                "time until the killed camera is back, ms",
                (measured.spread * requested.max_return_ms).round(),
                cost.back_ms,
            ),
            at_least(
                "results of the other cameras during the fault",
                f64::from(u8::from(needs_results)),
                results,
            ),
            at_most(
                "longest pause between results, ms",
                (measured.slowness * requested.max_pause_ms).round(),
                cost.longest_pause_ms,
            ),
        ]);
    }
    let unanswered: u64 = measured.views.iter().map(|view| view.unanswered).sum();
    let may_be_lost = if measured.cost.is_some() {
        MAX_UNACCOUNTED
    } else {
        0
    };
    limits.extend([
        at_most(
            "frames unaccounted for",
            may_be_lost as f64,
            Some(unanswered as f64),
        ),
        none_of("other processes that failed", measured.failed),
        at_most(
            "results not written",
            0.0,
            measured.n_unwritten.map(|n| n as f64),
        ),
    ]);
    limits
}

/// Returns true if the camera was missing for so long that the other views must have produced results in the meantime. This is the case if
/// it was missing for longer than the usual pause between results plus the deadline for a late view.
fn needs_results_meanwhile(cost: &Cost, deadline_ms: f64) -> bool {
    let away = cost.back_ms.unwrap_or(f64::INFINITY);
    away > 2.0 * cost.usual_pause_ms.unwrap_or(0.0) + deadline_ms
}

fn share(n: usize, of: usize) -> Option<f64> {
    (of > 0).then(|| 100.0 * n as f64 / of as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Limits = Limits {
        min_results: 10.0,
        min_skeletons: 90.0,
        min_pcp3d: 50.0,
        max_return_ms: 8000.0,
        max_pause_ms: 2000.0,
    };

    fn score(pcp3d_percent: Option<f64>) -> Score {
        Score {
            skeletons: 90,
            pcp3d_percent,
            mpjpe_mm: None,
            lost_percent: None,
            segments: Vec::new(),
        }
    }

    fn cost() -> Cost {
        Cost {
            killed_at_ms: Some(9000.0),
            back_ms: Some(1200.0),
            results_without_it: 4,
            usual_pause_ms: Some(300.0),
            longest_pause_ms: Some(420.0),
            ..Cost::default()
        }
    }

    fn view(unanswered: u64) -> ViewReport {
        ViewReport {
            name: "c1".to_owned(),
            frames: 100,
            used: 100 - unanswered,
            empty: 0,
            late: 0,
            dropped: 0,
            lost: 0,
            unanswered,
            faults: std::collections::BTreeMap::new(),
            missing: Vec::new(),
        }
    }

    /// Measurements of a good run.
    struct Run {
        n_results: [usize; 2],
        score: Score,
        cost: Option<Cost>,
        views: Vec<ViewReport>,
        failed: Vec<String>,
        n_unwritten: Option<u64>,
        slowness: f64,
        spread: f64,
    }

    impl Run {
        fn changed(change: impl FnOnce(&mut Self)) -> Self {
            let mut run = Self {
                n_results: [90, 88],
                score: score(Some(70.0)),
                cost: Some(cost()),
                views: vec![view(1), view(1)],
                failed: Vec::new(),
                n_unwritten: Some(0),
                slowness: 1.0,
                spread: 1.0,
            };
            change(&mut run);
            run
        }

        fn changed_cost(&mut self, change: fn(&mut Cost)) {
            self.cost.iter_mut().for_each(change);
        }

        fn limits(&self) -> Vec<Limit> {
            let measured = Measured {
                n_frames: 100,
                n_results: self.n_results,
                score: &self.score,
                cost: self.cost.as_ref(),
                deadline_ms: 500.0,
                slowness: self.slowness,
                spread: self.spread,
                views: &self.views,
                failed: &self.failed,
                n_unwritten: self.n_unwritten,
            };
            judge(&ASKED, &measured)
        }
    }

    /// Returns the limits that a good run misses if `change` is applied to its measurements.
    fn missed(change: impl FnOnce(&mut Run)) -> Vec<String> {
        let limits = Run::changed(change).limits().into_iter();
        limits.filter(|limit| !limit.held).map(|limit| limit.what).collect()
    }

    #[test]
    fn a_good_run_meets_all_limits() {
        assert_eq!(missed(|_| ()), Vec::<String>::new());
        assert_eq!(Run::changed(|_| ()).limits().len(), 9);
    }

    #[test]
    fn each_limit_of_the_demo_can_be_missed_separately() {
        type Change = fn(&mut Run);
        let changes: [(Change, &str); 10] = [
            (|run| run.n_results = [9, 9], "frames with a result, %"),
            (|run| run.n_results = [90, 80], "results with a skeleton, %"),
            (|run| run.score = score(Some(49.9)), "PCP3D at 0.5, %"),
            (|run| run.score = score(None), "PCP3D at 0.5, %"),
            (
                |run| run.changed_cost(|cost| cost.back_ms = Some(8001.0)),
                "time until the killed camera is back, ms",
            ),
            (
                |run| run.changed_cost(|cost| cost.back_ms = None),
                "time until the killed camera is back, ms",
            ),
            (
                |run| run.changed_cost(|cost| cost.results_without_it = 0),
                "results of the other cameras during the fault",
            ),
            (
                |run| run.changed_cost(|cost| cost.longest_pause_ms = Some(2001.0)),
                "longest pause between results, ms",
            ),
            (|run| run.views[0] = view(2), "frames unaccounted for"),
            (
                |run| run.failed.push("pose-1".to_owned()),
                "other processes that failed",
            ),
        ];
        for (change, expected) in changes {
            assert_eq!(missed(change), [expected]);
        }
        assert_eq!(
            missed(|run| run.n_unwritten = Some(1)),
            ["results not written"]
        );
        assert_eq!(
            missed(|run| run.n_unwritten = None),
            ["results not written"]
        );
    }

    #[test]
    fn on_a_slower_machine_only_limits_on_times_are_larger() {
        let slow = |run: &mut Run| (run.slowness, run.spread) = (3.0, 2.0);
        for (back_ms, pause_ms, expected) in [
            (16_000.0, 6000.0, &[][..]),
            (
                16_001.0,
                6000.0,
                &["time until the killed camera is back, ms"],
            ),
            (16_000.0, 6001.0, &["longest pause between results, ms"]),
        ] {
            let got = missed(|run| {
                slow(run);
                if let Some(cost) = &mut run.cost {
                    (cost.back_ms, cost.longest_pause_ms) = (Some(back_ms), Some(pause_ms));
                }
            });
            assert_eq!(got, expected);
        }
        let got = missed(|run| {
            slow(run);
            run.score = score(Some(49.9));
        });
        assert_eq!(got, ["PCP3D at 0.5, %"]);
    }

    #[test]
    fn a_planned_kill_that_did_not_happen_misses_limits() {
        let got = missed(|run| run.cost = Some(Cost::default()));
        assert_eq!(got.len(), 3, "{got:?}");
    }

    #[test]
    fn no_results_are_required_during_the_absence_if_the_camera_is_back_at_once() {
        let back = |ms: f64| {
            move |run: &mut Run| {
                if let Some(cost) = &mut run.cost {
                    (cost.results_without_it, cost.back_ms) = (0, Some(ms));
                }
            }
        };
        assert_eq!(missed(back(1099.0)), Vec::<String>::new());
        assert_eq!(
            missed(back(1101.0)),
            ["results of the other cameras during the fault"]
        );
    }

    #[test]
    fn without_a_kill_no_frame_may_be_unaccounted_for() {
        let got = missed(|run| run.cost = None);
        assert_eq!(got, ["frames unaccounted for"]);
    }
}
