//! The frame counts of every view of a run.

use core::fmt;
use std::collections::BTreeMap;

use messages::Status;
use runfiles::{Missing, Summary};
use serde::Serialize;
use supervise::{Counts, Outcome};

use crate::resolved::Resolved;

/// The frame counts of one view. `frames` is the sum of the counts from `used` to `unanswered`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ViewReport {
    /// Name of the camera.
    pub name: String,
    /// Number of frames of the footage.
    pub frames: u64,
    /// Frames that were used in a result.
    pub used: u64,
    /// Frames in which nobody was found, or that the camera could not deliver.
    pub empty: u64,
    /// Frames whose pose came too late for a result.
    pub late: u64,
    /// Frames that were dropped for lack of time.
    pub dropped: u64,
    /// Frames that were lost because a process was dead, or died while processing them.
    pub lost: u64,
    /// All other frames, which were not processed before the run was stopped.
    pub unanswered: u64,
    /// Number of results with a camera fault, by cause. These are included in `empty`.
    pub faults: BTreeMap<String, u64>,
    /// Number of results without this view, by reason.
    #[serde(skip)]
    pub missing: Vec<(Missing, u64)>,
}

impl ViewReport {
    /// Combines the counts of the supervisor with the summary of the process `results`.
    ///
    /// * `summary`: the summary, if there is one.
    pub fn all(resolved: &Resolved, outcome: &Outcome, summary: Option<&Summary>) -> Vec<Self> {
        let counts = |process: String| {
            let found = outcome.processes.iter().find(|candidate| candidate.name == process);
            found.map_or_else(Counts::default, |process| process.counts)
        };
        let n_reached = n_reached(resolved, outcome);
        let cameras = resolved.deployment.cameras.iter().zip(&resolved.footage);
        let views = cameras.enumerate().map(|(view, (camera, footage))| {
            let counts = ["capture", "pose"].map(|name| counts(format!("{name}-{view}")));
            let n_frames = if resolved.is_endless() {
                n_reached
            } else {
                footage.n_frames
            };
            Self::new(&camera.name, n_frames, counts, summary)
        });
        views.collect()
    }

    /// Combines the counts of one view.
    ///
    /// * `frames`: number of frames of the footage.
    /// * `[camera, pose]`: counts of the capture process and the pose process of the view.
    fn new(
        name: &str,
        frames: u64,
        [camera, pose]: [Counts; 2],
        summary: Option<&Summary>,
    ) -> Self {
        // Without a summary, no frame is known to be used.
        let reasons = summary.and_then(|summary| summary.views_missing.get(name));
        let missing: Vec<(Missing, u64)> = reasons.cloned().into_iter().flatten().collect();
        let used = summary.and_then(|summary| summary.views_present.get(name));
        let used = used.copied().unwrap_or(0);
        let empty = missing.iter().filter(|missing| missing.0.is_answer());
        let empty: u64 = empty.map(|empty| empty.1).sum();
        // The last count of a killed process may not have arrived.
        let answered = pose.n_sent.max(used + empty);
        let not_processed =
            (camera.n_dropped + pose.n_dropped).min(frames.saturating_sub(answered));
        let of = |reason: &str| missing.iter().find(|entry| entry.0.text() == reason);
        let lost = of(Missing::PROCESS_LOST).map_or(0, |entry| entry.1).min(not_processed);
        let faults = Status::CAMERA_FAULTS.iter();
        let faults =
            faults.filter_map(|status| Some((status.reason().to_owned(), of(status.reason())?.1)));
        Self {
            name: name.to_owned(),
            frames,
            used,
            empty,
            late: answered - used - empty,
            dropped: not_processed - lost,
            lost,
            unanswered: frames.saturating_sub(answered + not_processed),
            faults: faults.collect(),
            missing,
        }
    }

    /// Returns true if the view is missing from a result for a reason that does not normally occur with this kind of delivery.
    pub fn is_lost(&self, is_lossless: bool) -> bool {
        let is_expected = |reason: &Missing| match reason {
            Missing::Late | Missing::Dropped => !is_lossless,
            other => other.text() == Status::NO_DETECTION.reason(),
        };
        self.missing.iter().any(|(reason, n)| *n > 0 && !is_expected(reason))
    }
}

/// Returns the number of frames of a run. For live cameras without an end, these are the frames that were sent.
pub(crate) fn n_reached(resolved: &Resolved, outcome: &Outcome) -> u64 {
    if !resolved.is_endless() {
        return resolved.n_frames();
    }
    let capture = &resolved.deployment.capture;
    let cameras = outcome
        .processes
        .iter()
        .filter(|process| ["capture", "bridge"].contains(&process.service.as_str()));
    let last = cameras.filter_map(|camera| camera.last.as_ref().filter(|last| last.n_sent > 0));
    let last = last.map(|last| last.last_frame.saturating_sub(capture.start_frame)).max();
    last.map_or(0, |value| value / capture.frame_step.max(1) + 1)
}

impl fmt::Display for ViewReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} of {} frames", self.name, self.used, self.frames)?;
        for (n, what) in [
            (self.empty, "empty"),
            (self.late, "late"),
            (self.dropped, "dropped"),
            (self.lost, "lost"),
            (self.unanswered, "not answered"),
        ] {
            if n > 0 {
                write!(f, ", {n} {what}")?;
            }
        }
        for (nth, (cause, n)) in self.faults.iter().enumerate() {
            let between = if nth == 0 { "; camera: " } else { ", " };
            write!(f, "{between}{n} {cause}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn view(missing: &Value) -> ViewReport {
        let camera = Counts {
            n_dropped: 4,
            ..Counts::default()
        };
        let pose = Counts {
            n_sent: 12,
            n_dropped: 3,
            ..Counts::default()
        };
        let missing = serde_json::from_value(missing.clone()).unwrap();
        let summary = Summary {
            views_present: [("a".to_owned(), 9)].into(),
            views_missing: [("a".to_owned(), missing)].into(),
            ..Summary::default()
        };
        ViewReport::new("a", 20, [camera, pose], Some(&summary))
    }

    #[test]
    fn every_frame_is_counted_once() {
        let got = view(&json!({ "no detection": 2, "late": 1, "dropped": 5, "process lost": 3 }));
        let all = [
            got.used,
            got.empty,
            got.late,
            got.dropped,
            got.lost,
            got.unanswered,
        ];
        assert_eq!(all, [9, 2, 1, 4, 3, 1]);
        assert_eq!(all.iter().sum::<u64>(), got.frames);
        let expected = "a: 9 of 20 frames, 2 empty, 1 late, 4 dropped, 3 lost, 1 not answered";
        assert_eq!(got.to_string(), expected);
    }

    #[test]
    fn camera_faults_are_shown_by_cause() {
        let got =
            view(&json!({ "no detection": 1, "frozen picture": 1, "camera gone": 1, "late": 1 }));
        let faults = json!({ "camera gone": 1, "frozen picture": 1 });
        assert_eq!(serde_json::to_value(&got.faults).unwrap(), faults);
        assert_eq!(got.empty, 3);
        let text = got.to_string();
        assert!(
            text.ends_with("; camera: 1 camera gone, 1 frozen picture"),
            "{text}"
        );
    }

    #[test]
    fn late_and_dropped_frames_are_losses_with_lossless_delivery_only() {
        for (reason, expected) in [
            ("no detection", [false, false]),
            ("late", [false, true]),
            ("dropped", [false, true]),
            ("process lost", [true, true]),
            ("no frame", [true, true]),
            ("end of footage", [true, true]),
        ] {
            let mut missing = json!({});
            missing[reason] = json!(1);
            let got = [false, true].map(|is_lossless| view(&missing).is_lost(is_lossless));
            assert_eq!(got, expected, "{reason}");
        }
    }
}
