//! The `camera-...` scenarios: a camera fails for a while.

use exports::report::run::Limit;
use failure::Failure;
use fastrand::Rng;
use serde::Serialize;
use serde_json::json;

use super::fault::CameraFault;
use super::judge::RunOutcome;
use super::options::{Limits, Options};
use super::target::{INJECT_AFTER, frame_at};
use super::testbed::Testbed;
use super::verdict::{Verdict, ms};
use crate::trial::limit::{at_least, at_most};
use crate::trial::results::FrameResult;

/// Duration of the fault, as a fraction of the footage's duration.
const SHARE: f64 = 0.2;
/// Number of repetitions after which a picture counts as frozen. It is small, so that the fault is detected in a short run.
const FROZEN_AFTER: &str = "capture.frozen_after=2";

/// Measurements of a run with a camera fault. Times are in milliseconds.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct CameraFailure {
    /// Name of the camera.
    pub camera: String,
    /// First frame of the fault, and first frame after it.
    pub span: [u64; 2],
    /// For each cause, the number of results of frames in `span` that state this cause for the missing view.
    pub flagged: Vec<(String, usize)>,
    /// Number of results of frames in `span` that use other views.
    pub results_without_it: usize,
    /// Longest time between two results of frames in `span` that use other views.
    pub longest_pause_ms: Option<f64>,
    /// Time from the last result of a frame in `span` to the first result that uses the camera again.
    pub back_ms: Option<f64>,
}

impl CameraFailure {
    /// Evaluates the results of a run.
    ///
    /// * `view`: the number of the camera's view.
    /// * `span`: the first frame of the fault, and the first frame after it.
    pub(super) fn new(
        fault: CameraFault,
        camera: &str,
        view: usize,
        span: [u64; 2],
        results: &[FrameResult],
    ) -> Self {
        let reason = |frame_result: &FrameResult| {
            frame_result.views.get(view).and_then(|view| view.missing.clone())
        };
        let during: Vec<&FrameResult> = results
            .iter()
            .filter(|result| (span[0]..span[1]).contains(&result.frame))
            .collect();
        let flagged = fault.parts().iter().map(|(_, status)| {
            let cause = status.reason();
            let n = during.iter().filter(|during| reason(during).as_deref() == Some(cause)).count();
            (cause.to_owned(), n)
        });
        let has_others =
            |result: &&&FrameResult| result.views.iter().any(|view| view.missing.is_none());
        let pauses = during.windows(2).map(|pair| pair[1].sent_ms - pair[0].sent_ms);
        let last = during.last().map(|during| during.sent_ms);
        let mut after = results.iter().filter(|result| result.frame >= span[1]);
        let back = after.find(|result| reason(result).is_none()).map(|after| after.sent_ms);
        Self {
            camera: camera.to_owned(),
            span,
            flagged: flagged.collect(),
            results_without_it: during.iter().filter(has_others).count(),
            longest_pause_ms: pauses.reduce(f64::max),
            back_ms: last.zip(back).map(|(last, back)| back - last),
        }
    }

    /// Checks the limits of the scenario.
    pub(super) fn judge(&self, limits: &Limits, outcome: &RunOutcome) -> Vec<Limit> {
        let flagged = self.flagged.iter();
        let flagged = flagged.map(|(cause, n)| {
            at_least(
                &format!("frames reported as: {cause}"),
                1.0,
                Some(*n as f64),
            )
        });
        let mut checked: Vec<Limit> = flagged.collect();
        checked.extend([
            at_least(
                "results of the others during the fault",
                1.0,
                Some(self.results_without_it as f64),
            ),
            at_most(
                "longest pause between results, ms",
                limits.max_pause_ms,
                self.longest_pause_ms,
            ),
            at_most("time until back, ms", limits.max_return_ms, self.back_ms),
        ]);
        checked.extend(outcome.judge(0));
        checked
    }

    /// Returns the measurements as text.
    fn measured(&self, n_results: usize) -> String {
        let flagged = self.flagged.iter().map(|(cause, n)| format!("{n} {cause}"));
        format!(
            "{}, {} frames: {}; {} results without the camera, longest pause: {}; back: {}; {n_results} results",
            self.camera,
            self.span[1] - self.span[0],
            flagged.collect::<Vec<_>>().join(", "),
            self.results_without_it,
            ms(self.longest_pause_ms),
            ms(self.back_ms),
        )
    }
}

/// Runs the deployment with a fault of a randomly chosen camera.
pub(super) fn attempt(
    testbed: &Testbed,
    options: &Options,
    fault: CameraFault,
) -> Result<Verdict, Failure> {
    let [scenario, _] = fault.name_and_summary();
    let plain = testbed.plan(scenario, &[])?;
    let cameras = &plain.resolved().deployment.cameras;
    let view = Rng::with_seed(options.seed).usize(..cameras.len());
    let camera = cameras[view].name.clone();
    let [from, to] =
        [INJECT_AFTER, INJECT_AFTER + SHARE].map(|share| frame_at(&plain, share) as u64);
    let span = [from, to.max(from + 3)];
    let setting = fault.setting(span);
    let planned = testbed.plan_with(scenario, &[FROZEN_AFTER], &|deployment| {
        if let (Some(camera), Ok(fault)) = (deployment.cameras.get_mut(view), setting.parse()) {
            camera.fault = fault;
        }
    })?;
    let run = testbed.run(&planned, &mut |_| None);
    let outcome = run.outcome(|_| 0);
    let failure = CameraFailure::new(fault, &camera, view, span, &run.results);
    Ok(Verdict {
        scenario: scenario.to_owned(),
        measured: failure.measured(outcome.n_results),
        details: Vec::new(),
        numbers: json!(failure),
        limits: failure.judge(&options.limits, &outcome),
        run: run.json(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::results::ViewResult;

    /// Returns a result of two views. If a reason is given, the second view is missing.
    fn moment(frame: u64, sent_ms: f64, missing: Option<&str>) -> FrameResult {
        let second = ViewResult {
            missing: missing.map(str::to_owned),
            ..ViewResult::default()
        };
        FrameResult {
            frame,
            epoch: 0,
            sent_ms,
            people: Vec::new(),
            views: vec![ViewResult::default(), second],
        }
    }

    fn failed(results: &[FrameResult]) -> CameraFailure {
        CameraFailure::new(CameraFault::Unplug, "b", 1, [2, 5], results)
    }

    fn missed(failure: &CameraFailure) -> Vec<String> {
        let limits = Limits {
            max_return_ms: 500.0,
            max_pause_ms: 200.0,
        };
        let outcome = RunOutcome {
            n_results: 6,
            ..RunOutcome::default()
        };
        let checked = failure.judge(&limits, &outcome).into_iter();
        checked.filter(|checked| !checked.held).map(|checked| checked.what).collect()
    }

    #[test]
    fn the_results_show_the_absence_and_the_return_of_a_camera() {
        let gone = Some("camera gone");
        let failure = failed(&[
            moment(1, 100.0, None),
            moment(2, 200.0, gone),
            moment(3, 300.0, Some("late")),
            moment(4, 450.0, gone),
            moment(5, 500.0, gone),
            moment(6, 600.0, None),
        ]);
        let expected = CameraFailure {
            camera: "b".to_owned(),
            span: [2, 5],
            flagged: vec![("camera gone".to_owned(), 2)],
            results_without_it: 3,
            longest_pause_ms: Some(150.0),
            back_ms: Some(150.0),
        };
        assert_eq!(failure, expected);
        assert_eq!(missed(&failure), [""; 0]);
    }

    #[test]
    fn an_undetected_fault_and_a_camera_that_never_returns_miss_limits() {
        let unnoticed: Vec<FrameResult> =
            (0..8).map(|i| moment(i, 100.0 * i as f64, None)).collect();
        assert_eq!(
            missed(&failed(&unnoticed)),
            ["frames reported as: camera gone"]
        );
        let gone = Some("camera gone");
        let never_back: Vec<FrameResult> =
            (0..8).map(|i| moment(i, 100.0 * i as f64, gone.filter(|_| i > 1))).collect();
        assert_eq!(missed(&failed(&never_back)), ["time until back, ms"]);
    }
}
