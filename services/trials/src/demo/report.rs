//! Report on the demo: accuracy, effects of the kill, and limits, as text and as JSON.

use core::fmt::Write as _;
use std::path::Path;

use exports::report::run::Limit;
use serde_json::{Value, json};

use super::limits::{self, Measured};
use super::options::Limits;
use super::run::{Run, VICTIM};
use super::score::{GAMMA, Score, score};
use crate::trial::cost::{Cost, EpochSource};
use crate::trial::results::FrameResult;

/// Report on the demo.
#[derive(Debug)]
pub(super) struct Report {
    /// Accuracy of all results, of the results with every view, and of the results without the killed camera's view.
    pub scores: [(&'static str, Score); 3],
    /// Effects of the kill; `None` if no kill was planned.
    pub cost: Option<Cost>,
    /// Limits, with the measured values.
    pub limits: Vec<Limit>,
}

impl Report {
    /// Evaluates a run.
    pub(super) fn new(run: &Run<'_>, requested: &Limits) -> Self {
        let of = |wanted: &dyn Fn(&FrameResult) -> bool| {
            let pairs = run.results.iter().zip(run.truth);
            let selected = pairs.filter(|pair| wanted(pair.0));
            let each = selected.flat_map(|(result, people)| {
                people.iter().map(|truth| (result.nearest(truth), &truth[..]))
            });
            score(each)
        };
        let scores = [
            ("all results", of(&|_| true)),
            (
                "results with every camera",
                of(&|result| result.views.iter().all(|view| view.missing.is_none())),
            ),
            (
                "without the killed camera",
                of(&|result| result.views[VICTIM].missing.is_some()),
            ),
        ];
        let cost = run.killed.map(|killed| {
            Cost::new(
                EpochSource::Camera(VICTIM),
                killed,
                run.session,
                run.results,
            )
        });
        let posed = run.results.iter().filter(|result| result.is_posed()).count();
        let summary = run.report.recorded().summary();
        let was_killed = cost.as_ref().is_some_and(|cost| cost.killed_at_ms.is_some());
        let killed = format!("capture-{VICTIM}");
        let measured = Measured {
            n_frames: run.n_frames,
            n_results: [run.results.len(), posed],
            score: &scores[0].1,
            cost: cost.as_ref(),
            deadline_ms: run.deadline_ms,
            slowness: run.machine.map_or(1.0, |machine| machine.slowness()),
            spread: run.machine.map_or(1.0, |machine| machine.spread()),
            views: run.report.views(),
            failed: &run
                .report
                .unexpected_failures(|process| u32::from(was_killed && process == killed)),
            n_unwritten: summary.map(|summary| summary.writes_failed + summary.frames_not_recorded),
        };
        let limits = limits::judge(requested, &measured);
        Self {
            scores,
            cost,
            limits,
        }
    }

    /// Returns true if all limits were met.
    pub(super) fn is_held(&self) -> bool {
        self.limits.iter().all(|limit| limit.held)
    }

    /// Returns the report as JSON, which is the content of `report.json`.
    pub(super) fn json(&self, run: &Run<'_>) -> Value {
        let limit = |limit: &Limit| json!({ "what": limit.what, "asked": limit.asked, "measured": limit.got, "held": limit.held });
        let [all, complete, without] = &self.scores;
        json!({
            "schema_version": 1,
            "held": self.is_held(),
            "limits": self.limits.iter().map(limit).collect::<Vec<_>>(),
            "frames": run.n_frames,
            "frames_with_result": run.results.len(),
            "frames_with_skeleton": run.results.iter().filter(|result| result.is_posed()).count(),
            "frame_rate_hz": run.rate_hz,
            "machine": run.machine.map(|machine| machine.json()),
            "processes": run.processes,
            "gamma": GAMMA,
            "accuracy": { "all": all.1, "every_camera": complete.1, "without_killed": without.1 },
            "killed_camera": self.cost.as_ref().map(|_| &run.cameras[VICTIM]),
            "killed": self.cost,
            "run": run.report.json(),
        })
    }

    /// Returns the report as text.
    pub(super) fn text(&self, folder: &Path) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _infallible = self.write(&mut text, folder);
        text.trim_end().to_owned()
    }

    fn write(&self, text: &mut String, folder: &Path) -> core::fmt::Result {
        writeln!(text, "\naccuracy against the truth")?;
        for (name, score) in &self.scores {
            if let (Some(pcp3d), Some(mpjpe)) = (score.pcp3d_percent, score.mpjpe_mm) {
                let skeletons = score.skeletons;
                writeln!(
                    text,
                    "  {name:<24} PCP3D {pcp3d:>5.1} %   MPJPE {mpjpe:>4.0} mm   {skeletons} skeletons"
                )?;
            }
        }
        writeln!(text, "limits")?;
        for it in &self.limits {
            let word = if it.held { "held  " } else { "MISSED" };
            writeln!(
                text,
                "  {word} {:<40} {:>12}   {}",
                it.what, it.asked, it.got
            )?;
        }
        writeln!(text, "report {}", folder.join("report.html").display())
    }
}
