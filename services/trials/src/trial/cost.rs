//! Effects of a process fault: the downtime, and the results of the other processes in the meantime.

use serde::Serialize;

use super::injection::FaultTimes;
use super::results::FrameResult;

/// Effects of a process fault. Times are in milliseconds after the fault.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Cost {
    /// Time of the injection, in milliseconds since the planning of the run; `None` if the fault was not injected.
    pub killed_at_ms: Option<f64>,
    /// Time until the supervisor noticed the fault.
    pub noticed_ms: Option<f64>,
    /// Time until the process was restarted.
    pub restarted_ms: Option<f64>,
    /// Time until the process sent its first message after the fault that contributed to a result.
    pub back_ms: Option<f64>,
    /// Last frame of the process that was used in a result before the fault.
    pub last_frame: Option<u64>,
    /// First frame of the process that was used in a result after the fault.
    pub first_frame: Option<u64>,
    /// Number of frames between `last_frame` and `first_frame`.
    pub frames_lost: Option<u64>,
    /// Number of results that the other views produced for frames between `last_frame` and `first_frame`.
    pub results_without_it: usize,
    /// Longest time between two results while the process was missing.
    pub longest_pause_ms: Option<f64>,
    /// Longest time between two results before the fault.
    pub usual_pause_ms: Option<f64>,
}

/// The part of a result that contains the epoch of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EpochSource {
    /// The process captures the frames of this view.
    Camera(usize),
    /// The process is the pose stage of this view.
    Pose(usize),
    /// The process makes the results.
    Result,
    /// No part of a result: only the health messages of the process contain its epoch.
    Unrecorded,
}

impl EpochSource {
    /// Returns the epoch of the process in a result, and the time at which the process sent its message, in milliseconds since the planning
    /// of the run.
    fn epoch(self, result: &FrameResult) -> Option<(u32, f64)> {
        match self {
            Self::Camera(view) => {
                result.views[view].camera.map(|camera| (camera.epoch, camera.sent_ms))
            }
            Self::Pose(view) => result.views[view].pose.map(|pose| (pose.epoch, pose.sent_ms)),
            Self::Result => Some((result.epoch, result.sent_ms)),
            Self::Unrecorded => None,
        }
    }

    /// Returns the time at which the process sent its first message of an epoch that contributed to a result, in milliseconds since the
    /// planning of the run; `None` if there is no result with this epoch.
    pub(crate) fn began_ms(self, epoch: u32, results: &[FrameResult]) -> Option<f64> {
        let mut sent = results.iter().filter_map(|result| self.epoch(result));
        sent.find(|pair| pair.0 == epoch).map(|sent| sent.1)
    }
}

impl Cost {
    /// Computes the effects from the times of the fault and the results of the run.
    ///
    /// * `source`: the part of a result that contains the epoch of the process.
    /// * `times`: the times of the fault.
    /// * `session`: the session, which is the time of planning (`failure::now_nanos`).
    pub(crate) fn new(
        source: EpochSource,
        times: FaultTimes,
        session: u64,
        results: &[FrameResult],
    ) -> Self {
        let Some(injected) = times.injected else {
            return Self::default();
        };
        let ms = |nanos: u64| nanos as f64 / 1e6;
        let injected_at = ms(injected.saturating_sub(session));
        let after = |nanos: u64| ms(nanos.saturating_sub(injected));
        let epochs = results.iter().filter_map(|result| Some((result, source.epoch(result)?)));
        let (old, new): (Vec<_>, Vec<_>) = epochs.partition(|epoch| epoch.1.0 == 0);
        let (last, first) = (old.last(), new.first());
        let recovered = times.recovered.filter(|_| source == EpochSource::Unrecorded).map(after);
        // The pause ends with the first result of the new epoch or, if results do not show the epoch, with the first result after the
        // recovery.
        let is_after_recovery =
            |result: &&FrameResult| recovered.is_some_and(|ms| result.sent_ms >= injected_at + ms);
        let end = first
            .map(|first| first.0)
            .or_else(|| results.iter().find(is_after_recovery))
            .map(|result| result.sent_ms);
        let end = end.unwrap_or(f64::INFINITY);
        let is_between = |result: &&FrameResult| match source {
            EpochSource::Unrecorded => result.sent_ms > injected_at && result.sent_ms < end,
            // Results are selected by frame number: the result of a frame captured in the meantime may be sent later.
            _ => {
                last.is_none_or(|last| result.frame > last.0.frame)
                    && first.is_none_or(|first| result.frame < first.0.frame)
            }
        };
        let away = results.iter().filter(is_between);
        Self {
            killed_at_ms: Some(injected_at),
            noticed_ms: times.noticed.map(after),
            restarted_ms: times.restarted.map(after),
            back_ms: first.map(|first| first.1.1 - injected_at).or(recovered),
            last_frame: last.map(|last| last.0.frame),
            first_frame: first.map(|first| first.0.frame),
            frames_lost: last
                .zip(first)
                .map(|(last, first)| first.0.frame.saturating_sub(last.0.frame + 1)),
            results_without_it: away.filter(|away| away.is_posed()).count(),
            longest_pause_ms: longest_pause(results, injected_at, end),
            usual_pause_ms: longest_pause(results, f64::NEG_INFINITY, injected_at),
        }
    }
}

/// Returns the longest time between two consecutive results, in milliseconds. The later result must have been sent in the given time span,
/// which includes both ends.
fn longest_pause(results: &[FrameResult], from: f64, to: f64) -> Option<f64> {
    let pairs = results.windows(2).map(|pair| [pair[0].sent_ms, pair[1].sent_ms]);
    let inside = pairs.filter(|pair| pair[1] >= from && pair[1] <= to);
    inside.map(|inside| inside[1] - inside[0]).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use runfiles::{CameraTimes, PoseTimes};

    use super::super::results::ViewResult;
    use super::*;

    /// Returns a result that was sent at a given time, and whose processes all have the given epoch. If no epoch is given, the view is
    /// missing.
    fn moment(frame: u64, sent_ms: f64, epoch: Option<u32>) -> FrameResult {
        let camera = epoch.map(|epoch| CameraTimes {
            epoch,
            captured_ms: sent_ms - 20.0,
            sent_ms: sent_ms - 10.0,
        });
        FrameResult {
            frame,
            epoch: epoch.unwrap_or(0),
            sent_ms,
            people: vec![vec![Some([0.0; 3]); 14]],
            views: vec![ViewResult {
                missing: camera.is_none().then(|| "process lost".to_owned()),
                camera,
                pose: epoch.map(|epoch| PoseTimes {
                    epoch,
                    sent_ms: sent_ms - 5.0,
                }),
            }],
        }
    }

    fn fault_at(at_ms: u64) -> FaultTimes {
        FaultTimes {
            injected: Some(1_000_000 * at_ms),
            noticed: Some(1_000_000 * (at_ms + 3)),
            ..FaultTimes::default()
        }
    }

    #[test]
    fn frames_and_results_between_two_epochs_are_counted() {
        let results = [
            moment(0, 100.0, Some(0)),
            moment(1, 200.0, Some(0)),
            moment(2, 300.0, Some(0)),
            moment(3, 600.0, None),
            moment(4, 700.0, None),
            moment(6, 900.0, Some(1)),
            moment(7, 1900.0, Some(1)),
        ];
        let got = Cost::new(EpochSource::Camera(0), fault_at(310), 0, &results);
        let expected = Cost {
            killed_at_ms: Some(310.0),
            noticed_ms: Some(3.0),
            restarted_ms: None,
            back_ms: Some(580.0),
            last_frame: Some(2),
            first_frame: Some(6),
            frames_lost: Some(3),
            results_without_it: 2,
            longest_pause_ms: Some(300.0),
            usual_pause_ms: Some(100.0),
        };
        assert_eq!(got, expected);
    }

    #[test]
    fn there_are_no_results_during_the_absence_if_the_other_views_wait() {
        let results = [
            moment(0, 100.0, Some(0)),
            moment(1, 200.0, Some(0)),
            moment(2, 5000.0, Some(1)),
        ];
        let got = Cost::new(EpochSource::Camera(0), fault_at(210), 0, &results);
        assert_eq!(got.results_without_it, 0);
        assert_eq!(got.longest_pause_ms, Some(4800.0));
    }

    #[test]
    fn each_process_counts_as_back_after_its_own_message() {
        let results = [
            moment(0, 100.0, Some(0)),
            moment(1, 300.0, Some(0)),
            moment(2, 900.0, Some(1)),
        ];
        let back = |source| Cost::new(source, fault_at(310), 0, &results).back_ms;
        assert_eq!(back(EpochSource::Camera(0)), Some(580.0));
        assert_eq!(back(EpochSource::Pose(0)), Some(585.0));
        assert_eq!(back(EpochSource::Result), Some(590.0));
        assert_eq!(
            back(EpochSource::Unrecorded),
            None,
            "there was no health message"
        );
        let began = |source: EpochSource, epoch| source.began_ms(epoch, &results);
        assert_eq!(began(EpochSource::Camera(0), 1), Some(890.0));
        assert_eq!(began(EpochSource::Pose(0), 0), Some(95.0));
        assert_eq!(began(EpochSource::Result, 2), None);
        assert_eq!(began(EpochSource::Unrecorded, 1), None);
    }

    #[test]
    fn health_messages_give_the_epochs_of_processes_that_results_do_not_contain() {
        let results = [
            moment(0, 100.0, None),
            moment(1, 300.0, None),
            moment(2, 500.0, None),
            moment(3, 1900.0, None),
        ];
        let times = FaultTimes {
            recovered: Some(1_000_000 * 810),
            ..fault_at(310)
        };
        let got = Cost::new(EpochSource::Unrecorded, times, 0, &results);
        assert_eq!(got.back_ms, Some(500.0));
        assert_eq!(
            (got.results_without_it, got.longest_pause_ms),
            (1, Some(1400.0))
        );
        assert_eq!((got.last_frame, got.frames_lost), (None, None));
    }

    #[test]
    fn a_process_that_is_not_restarted_counts_as_absent_to_the_end() {
        let results = [
            moment(0, 100.0, Some(0)),
            moment(1, 400.0, None),
            moment(2, 500.0, None),
        ];
        let got = Cost::new(EpochSource::Camera(0), fault_at(110), 0, &results);
        assert_eq!((got.back_ms, got.frames_lost), (None, None));
        assert_eq!(
            (got.results_without_it, got.longest_pause_ms),
            (2, Some(300.0))
        );
        assert_eq!(
            Cost::new(EpochSource::Camera(0), FaultTimes::default(), 0, &results),
            Cost::default()
        );
    }
}
