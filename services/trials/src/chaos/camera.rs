//! A camera that fails while the run goes on: what is said of its frames, and when it is back.

use fastrand::Rng;
use report::run::Limit;
use runtime::Failure;
use serde::Serialize;
use serde_json::json;

use super::aim::{STRIKE_AFTER, frame_at};
use super::fault::CameraFault;
use super::ground::Ground;
use super::judge::Aftermath;
use super::options::{Limits, Options};
use super::verdict::{Verdict, ms};
use crate::trial::limit::{at_least, at_most};
use crate::trial::results::Moment;

/// For so long a camera fails, as a share of the footage.
const SHARE: f64 = 0.2;
/// Repetitions from which on a picture is called frozen, so that a short run shows it.
const FROZEN_AFTER: &str = "capture.frozen_after=2";

/// What became of a run in which a camera failed. Times are milliseconds.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct Failed {
    /// The camera.
    pub camera: String,
    /// First frame of the fault, and one beyond the last.
    pub span: [u64; 2],
    /// Results of those frames that say why the camera has no part in them, by cause.
    pub flagged: Vec<(String, usize)>,
    /// Results of those frames in which others have a part.
    pub results_without_it: usize,
    /// Longest time between two of them.
    pub longest_pause_ms: Option<f64>,
    /// From the last result of those frames to the first in which the camera has a part again.
    pub back_ms: Option<f64>,
}

impl Failed {
    /// * `view`: of the camera.
    pub(super) fn new(
        fault: CameraFault,
        camera: &str,
        view: usize,
        span: [u64; 2],
        moments: &[Moment],
    ) -> Self {
        let reason = |it: &Moment| it.views.get(view).and_then(|it| it.missing.clone());
        let during: Vec<&Moment> = moments
            .iter()
            .filter(|it| (span[0]..span[1]).contains(&it.frame))
            .collect();
        let flagged = fault.parts().iter().map(|(_, status)| {
            let cause = status.reason();
            let n = during
                .iter()
                .filter(|it| reason(it).as_deref() == Some(cause))
                .count();
            (cause.to_owned(), n)
        });
        let has_others = |it: &&&Moment| it.views.iter().any(|it| it.missing.is_none());
        let pauses = during.windows(2).map(|it| it[1].sent_ms - it[0].sent_ms);
        let last = during.last().map(|it| it.sent_ms);
        let mut after = moments.iter().filter(|it| it.frame >= span[1]);
        let back = after.find(|it| reason(it).is_none()).map(|it| it.sent_ms);
        Self {
            camera: camera.to_owned(),
            span,
            flagged: flagged.collect(),
            results_without_it: during.iter().filter(has_others).count(),
            longest_pause_ms: pauses.reduce(f64::max),
            back_ms: last.zip(back).map(|(last, back)| back - last),
        }
    }

    /// What must hold.
    pub(super) fn judge(&self, asked: &Limits, after: &Aftermath) -> Vec<Limit> {
        let flagged = self.flagged.iter();
        let flagged = flagged
            .map(|(cause, n)| at_least(&format!("frames called {cause}"), 1.0, Some(*n as f64)));
        let mut limits: Vec<Limit> = flagged.collect();
        limits.extend([
            at_least(
                "results of others meanwhile",
                1.0,
                Some(self.results_without_it as f64),
            ),
            at_most(
                "longest pause of results meanwhile, ms",
                asked.max_pause_ms,
                self.longest_pause_ms,
            ),
            at_most("back after, ms", asked.max_return_ms, self.back_ms),
        ]);
        limits.extend(after.judge(0));
        limits
    }

    /// For people.
    fn measured(&self, n_results: usize) -> String {
        let flagged = self.flagged.iter().map(|(cause, n)| format!("{n} {cause}"));
        format!(
            "{}, {} frames: {}; {} results without it, longest pause {}; back {}; {n_results} results",
            self.camera,
            self.span[1] - self.span[0],
            flagged.collect::<Vec<_>>().join(", "),
            self.results_without_it,
            ms(self.longest_pause_ms),
            ms(self.back_ms),
        )
    }
}

/// Lets a camera chosen at random fail.
pub(super) fn attempt(
    ground: &Ground,
    options: &Options,
    fault: CameraFault,
) -> Result<Verdict, Failure> {
    let [scenario, _] = fault.words();
    let plain = ground.plan(scenario, &[])?;
    let cameras = &plain.resolved().deployment.cameras;
    let view = Rng::with_seed(options.seed).usize(..cameras.len());
    let camera = cameras[view].name.clone();
    let [from, to] =
        [STRIKE_AFTER, STRIKE_AFTER + SHARE].map(|share| frame_at(&plain, share) as u64);
    let span = [from, to.max(from + 3)];
    let setting = fault.setting(span);
    let planned = ground.plan_with(scenario, &[FROZEN_AFTER], &|deployment| {
        if let (Some(camera), Ok(fault)) = (deployment.cameras.get_mut(view), setting.parse()) {
            camera.fault = fault;
        }
    })?;
    let ran = ground.watch(&planned, &mut |_| None);
    let after = ran.aftermath(|_| 0);
    let it = Failed::new(fault, &camera, view, span, &ran.moments);
    Ok(Verdict {
        scenario: scenario.to_owned(),
        measured: it.measured(after.n_results),
        more: Vec::new(),
        numbers: json!(it),
        limits: it.judge(&options.limits, &after),
        run: ran.json(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::results::Seen;

    /// A result of two views, the second of which is missing for a reason.
    fn moment(frame: u64, sent_ms: f64, missing: Option<&str>) -> Moment {
        let second = Seen {
            missing: missing.map(str::to_owned),
            ..Seen::default()
        };
        Moment {
            frame,
            epoch: 0,
            sent_ms,
            joints: Vec::new(),
            views: vec![Seen::default(), second],
        }
    }

    fn failed(moments: &[Moment]) -> Failed {
        Failed::new(CameraFault::Unplug, "b", 1, [2, 5], moments)
    }

    fn missed(it: &Failed) -> Vec<String> {
        let asked = Limits {
            max_return_ms: 500.0,
            max_pause_ms: 200.0,
        };
        let after = Aftermath {
            n_results: 6,
            ..Aftermath::default()
        };
        let limits = it.judge(&asked, &after).into_iter();
        limits.filter(|it| !it.held).map(|it| it.what).collect()
    }

    #[test]
    fn a_camera_that_leaves_and_comes_back_is_told_by_its_results() {
        let gone = Some("camera gone");
        let it = failed(&[
            moment(1, 100.0, None),
            moment(2, 200.0, gone),
            moment(3, 300.0, Some("late")),
            moment(4, 450.0, gone),
            moment(5, 500.0, gone),
            moment(6, 600.0, None),
        ]);
        let expected = Failed {
            camera: "b".to_owned(),
            span: [2, 5],
            flagged: vec![("camera gone".to_owned(), 2)],
            results_without_it: 3,
            longest_pause_ms: Some(150.0),
            back_ms: Some(150.0),
        };
        assert_eq!(it, expected);
        assert_eq!(missed(&it), [""; 0]);
    }

    #[test]
    fn a_fault_that_nobody_notices_and_a_camera_that_stays_away_are_misses() {
        let unnoticed: Vec<Moment> = (0..8)
            .map(|it| moment(it, 100.0 * it as f64, None))
            .collect();
        assert_eq!(missed(&failed(&unnoticed)), ["frames called camera gone"]);
        let gone = Some("camera gone");
        let for_ever: Vec<Moment> = (0..8)
            .map(|it| moment(it, 100.0 * it as f64, gone.filter(|_| it > 1)))
            .collect();
        assert_eq!(missed(&failed(&for_ever)), ["back after, ms"]);
    }
}
