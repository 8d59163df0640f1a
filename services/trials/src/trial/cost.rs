//! What a killed process cost: how long it was away, what the others did meanwhile.

use serde::Serialize;

use super::results::Moment;
use super::strike::Times;

/// What a killed process cost. Times are milliseconds after it was killed.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Cost {
    /// When it was killed, milliseconds since the run was planned; none if it never was.
    pub killed_at_ms: Option<f64>,
    /// When the supervisor noticed.
    pub noticed_ms: Option<f64>,
    /// When the process was started again.
    pub restarted_ms: Option<f64>,
    /// When it sent the first frame of its new life that has a result.
    pub back_ms: Option<f64>,
    /// The last frame of its old life that has a result, and the first of its new one.
    pub last_frame: Option<u64>,
    /// The first frame of its new life that has a result.
    pub first_frame: Option<u64>,
    /// Its frames in between.
    pub frames_lost: Option<u64>,
    /// Results that the other views gave of the frames in between.
    pub results_without_it: usize,
    /// Longest time between two results while it was away.
    pub longest_pause_ms: Option<f64>,
    /// Longest time between two results before it was killed.
    pub usual_pause_ms: Option<f64>,
}

/// Where the results say which life of a process they owe to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trace {
    /// It is the camera of a view.
    Camera(usize),
    /// It answers for a view.
    Pose(usize),
    /// It makes the results.
    Result,
    /// Nowhere: only its signs of life tell.
    Nowhere,
}

impl Trace {
    /// The life that a result owes to, and when that life sent what it owes.
    fn life(self, it: &Moment) -> Option<(u32, f64)> {
        match self {
            Self::Camera(view) => it.views[view].shot.map(|it| (it.epoch, it.sent_ms)),
            Self::Pose(view) => it.views[view].answer.map(|it| (it.epoch, it.sent_ms)),
            Self::Result => Some((it.epoch, it.sent_ms)),
            Self::Nowhere => None,
        }
    }

    /// When a life sent the first of what a result owes to, milliseconds since the run was planned; none of
    /// processes that results do not name.
    pub(crate) fn began_ms(self, life: u32, moments: &[Moment]) -> Option<f64> {
        let mut sent = moments.iter().filter_map(|it| self.life(it));
        sent.find(|it| it.0 == life).map(|it| it.1)
    }
}

impl Cost {
    /// Puts together what the kill and the results say.
    ///
    /// * `trace`: of the process.
    /// * `times`: of the kill, as it was ordered.
    /// * `session`: when the run was planned, by the same clock.
    pub(crate) fn new(trace: Trace, times: Times, session: u64, moments: &[Moment]) -> Self {
        let Some(killed) = times.killed else {
            return Self::default();
        };
        let ms = |nanos: u64| nanos as f64 / 1e6;
        let killed_at = ms(killed.saturating_sub(session));
        let after = |it: u64| ms(it.saturating_sub(killed));
        let lives = moments.iter().filter_map(|it| Some((it, trace.life(it)?)));
        let (old, new): (Vec<_>, Vec<_>) = lives.partition(|it| it.1.0 == 0);
        let (last, first) = (old.last(), new.first());
        let heard = times.heard.filter(|_| trace == Trace::Nowhere).map(after);
        // What came first with the new life, or at least after it, ends the pause, if it was one.
        let after_heard = |it: &&Moment| heard.is_some_and(|ms| it.sent_ms >= killed_at + ms);
        let end = first
            .map(|it| it.0)
            .or_else(|| moments.iter().find(after_heard))
            .map(|it| it.sent_ms);
        let end = end.unwrap_or(f64::INFINITY);
        let is_between = |it: &&Moment| match trace {
            Trace::Nowhere => it.sent_ms > killed_at && it.sent_ms < end,
            // By frames, for what was taken meanwhile may have its result a little later.
            _ => {
                last.is_none_or(|last| it.frame > last.0.frame)
                    && first.is_none_or(|first| it.frame < first.0.frame)
            }
        };
        let away = moments.iter().filter(is_between);
        Self {
            killed_at_ms: Some(killed_at),
            noticed_ms: times.noticed.map(after),
            restarted_ms: times.started.map(after),
            back_ms: first.map(|it| it.1.1 - killed_at).or(heard),
            last_frame: last.map(|it| it.0.frame),
            first_frame: first.map(|it| it.0.frame),
            frames_lost: last
                .zip(first)
                .map(|(last, first)| first.0.frame.saturating_sub(last.0.frame + 1)),
            results_without_it: away.filter(|it| it.is_posed()).count(),
            longest_pause_ms: longest_pause(moments, killed_at, end),
            usual_pause_ms: longest_pause(moments, f64::NEG_INFINITY, killed_at),
        }
    }
}

/// Longest time between two results of which the later was sent in a span of time, both ends included.
fn longest_pause(moments: &[Moment], from: f64, to: f64) -> Option<f64> {
    let pairs = moments.windows(2).map(|it| [it[0].sent_ms, it[1].sent_ms]);
    let those = pairs.filter(|it| it[1] >= from && it[1] <= to);
    those.map(|it| it[1] - it[0]).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use runfiles::{CameraTimes, PoseTimes};

    use super::super::results::Seen;
    use super::*;

    /// A result sent at a time; the camera's frame by the life that sent it.
    fn moment(frame: u64, sent_ms: f64, epoch: Option<u32>) -> Moment {
        let shot = epoch.map(|epoch| CameraTimes {
            epoch,
            captured_ms: sent_ms - 20.0,
            sent_ms: sent_ms - 10.0,
        });
        Moment {
            frame,
            epoch: epoch.unwrap_or(0),
            sent_ms,
            joints: vec![Some([0.0; 3]); 14],
            views: vec![Seen {
                missing: shot.is_none().then(|| "process lost".to_owned()),
                shot,
                answer: epoch.map(|epoch| PoseTimes {
                    epoch,
                    sent_ms: sent_ms - 5.0,
                }),
            }],
        }
    }

    fn killed(at_ms: u64) -> Times {
        Times {
            killed: Some(1_000_000 * at_ms),
            noticed: Some(1_000_000 * (at_ms + 3)),
            ..Times::default()
        }
    }

    #[test]
    fn what_happened_between_two_lives_is_counted() {
        let moments = [
            moment(0, 100.0, Some(0)),
            moment(1, 200.0, Some(0)),
            moment(2, 300.0, Some(0)),
            moment(3, 600.0, None),
            moment(4, 700.0, None),
            moment(6, 900.0, Some(1)),
            moment(7, 1900.0, Some(1)),
        ];
        let got = Cost::new(Trace::Camera(0), killed(310), 0, &moments);
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
    fn who_waits_for_the_dead_gives_nothing_without_it() {
        let moments = [
            moment(0, 100.0, Some(0)),
            moment(1, 200.0, Some(0)),
            moment(2, 5000.0, Some(1)),
        ];
        let got = Cost::new(Trace::Camera(0), killed(210), 0, &moments);
        assert_eq!(got.results_without_it, 0);
        assert_eq!(got.longest_pause_ms, Some(4800.0));
    }

    #[test]
    fn every_stage_is_back_with_what_it_sent_itself() {
        let moments = [
            moment(0, 100.0, Some(0)),
            moment(1, 300.0, Some(0)),
            moment(2, 900.0, Some(1)),
        ];
        let back = |trace| Cost::new(trace, killed(310), 0, &moments).back_ms;
        assert_eq!(back(Trace::Camera(0)), Some(580.0));
        assert_eq!(back(Trace::Pose(0)), Some(585.0));
        assert_eq!(back(Trace::Result), Some(590.0));
        assert_eq!(back(Trace::Nowhere), None, "it was not heard of");
        let began = |trace: Trace, life| trace.began_ms(life, &moments);
        assert_eq!(began(Trace::Camera(0), 1), Some(890.0));
        assert_eq!(began(Trace::Pose(0), 0), Some(95.0));
        assert_eq!(began(Trace::Result, 2), None);
        assert_eq!(began(Trace::Nowhere, 1), None);
    }

    #[test]
    fn of_whom_the_results_say_nothing_the_signs_of_life_tell() {
        let moments = [
            moment(0, 100.0, None),
            moment(1, 300.0, None),
            moment(2, 500.0, None),
            moment(3, 1900.0, None),
        ];
        let times = Times {
            heard: Some(1_000_000 * 810),
            ..killed(310)
        };
        let got = Cost::new(Trace::Nowhere, times, 0, &moments);
        assert_eq!(got.back_ms, Some(500.0));
        assert_eq!(
            (got.results_without_it, got.longest_pause_ms),
            (1, Some(1400.0))
        );
        assert_eq!((got.last_frame, got.frames_lost), (None, None));
    }

    #[test]
    fn who_never_comes_back_is_away_to_the_end() {
        let moments = [
            moment(0, 100.0, Some(0)),
            moment(1, 400.0, None),
            moment(2, 500.0, None),
        ];
        let got = Cost::new(Trace::Camera(0), killed(110), 0, &moments);
        assert_eq!((got.back_ms, got.frames_lost), (None, None));
        assert_eq!(
            (got.results_without_it, got.longest_pause_ms),
            (2, Some(300.0))
        );
        assert_eq!(
            Cost::new(Trace::Camera(0), Times::default(), 0, &moments),
            Cost::default()
        );
    }
}
