//! All processes of a deployment at one moment: who lives, and what each has said last.

use std::collections::BTreeMap;

use metrics::{Reading, ReadingError};
use runtime::ObservedProcess;

use crate::resolved::SERVICES;

/// A process that has said nothing for so long hangs, or is stopped: several times the second after
/// which it should have.
const SILENT_NANOS: u64 = 5_000_000_000;

/// How a process stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// It works.
    Runs,
    /// It has seen the end of the footage and passed it on.
    Done,
    /// It lives, and has not said anything in this life.
    Begins,
    /// It lives, and has said nothing for a while.
    Silent,
    /// It does not live; the supervisor may start it again.
    Dead,
}

impl Standing {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Runs => "runs",
            Self::Done => "done",
            Self::Begins => "begins",
            Self::Silent => "silent",
            Self::Dead => "dead",
        }
    }
}

/// One process.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its name in the deployment.
    pub process: String,
    /// Its process id, while it lives.
    pub pid: Option<u32>,
    /// How it stands.
    pub standing: Standing,
    /// What it has said last, if that can be read. Of a dead process, its last words.
    pub reading: Option<Reading>,
    /// Why what it says cannot be read.
    pub problem: Option<ReadingError>,
    /// How long ago that was, nanoseconds.
    pub age_nanos: u64,
}

/// All processes of a deployment at one moment.
#[derive(Debug, Clone)]
pub struct Board {
    /// The name of the deployment.
    pub name: String,
    /// The process that runs it.
    pub supervisor: u32,
    /// Its processes: in the order in which a frame passes through them.
    pub members: Vec<Member>,
}

impl Board {
    pub(super) fn new(name: &str, supervisor: u32, seen: &[ObservedProcess<'_>], now: u64) -> Self {
        let mut members: Vec<Member> = seen.iter().map(|it| Member::new(it, now)).collect();
        members.sort_by_key(|it| place(&it.process));
        Self {
            name: name.to_owned(),
            supervisor,
            members,
        }
    }

    /// The names of the views, as far as a process has said them.
    pub fn views(&self) -> BTreeMap<usize, &str> {
        let readings = self.members.iter().filter_map(|it| it.reading.as_ref());
        readings
            .filter_map(|it| it.view.as_ref())
            .filter(|it| !it.name.is_empty())
            .map(|it| (it.index, it.name.as_str()))
            .collect()
    }

    /// Whether everybody who lives has said something.
    pub(super) fn is_complete(&self) -> bool {
        let begins = |it: &Member| it.standing == Standing::Begins;
        !self.members.iter().any(begins)
    }
}

impl Member {
    fn new(seen: &ObservedProcess<'_>, now: u64) -> Self {
        let read = seen.metrics.map(Reading::from_message);
        let age_nanos = seen.metrics.map_or(0, |it| now.saturating_sub(it.at_nanos));
        let (reading, problem) = match read {
            None => (None, None),
            Some(Ok(reading)) => (Some(reading), None),
            Some(Err(problem)) => (None, Some(problem)),
        };
        let of_this_life = reading.as_ref().filter(|it| seen.pid == Some(it.pid));
        let standing = match (seen.pid, of_this_life) {
            (None, _) => Standing::Dead,
            (Some(_), None) if problem.is_none() => Standing::Begins,
            _ if age_nanos > SILENT_NANOS => Standing::Silent,
            (_, Some(it)) if it.is_finished => Standing::Done,
            _ => Standing::Runs,
        };
        Self {
            process: seen.process.to_owned(),
            pid: seen.pid,
            standing,
            reading,
            problem,
            age_nanos,
        }
    }
}

/// Where in the way of a frame a process stands.
fn place(process: &str) -> (usize, usize, String) {
    let (service, index) = process.split_once('-').unwrap_or((process, "0"));
    let nth = SERVICES.iter().position(|it| *it == service);
    let index = index.parse().unwrap_or(usize::MAX);
    (nth.unwrap_or(SERVICES.len()), index, process.to_owned())
}

#[cfg(test)]
pub(crate) mod tests {
    use messages::{Cause, Span};
    use metrics::{Meter, Passage};

    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// What a process says ten seconds after the clock began.
    pub(crate) fn said(pid: u32, view: Option<usize>) -> messages::Metrics {
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
        let mut it = messages::Metrics {
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
            it.rows[index] = meter.row(index).unwrap();
            it.rows[index].millihertz = 19_960;
        }
        it.n_rows = meter.n_rows() as u32;
        it
    }

    /// A board at 11 s: two that run, one that is dead, one that begins.
    pub(crate) fn board() -> Board {
        let (pose, record) = (said(17, Some(0)), said(18, None));
        let sighting = |process, pid, metrics| ObservedProcess {
            process,
            pid,
            metrics,
        };
        let seen = [
            sighting("capture-10", None, None),
            sighting("capture-9", Some(4), None),
            sighting("pose-0", Some(17), Some(&pose)),
            sighting("results", Some(18), Some(&record)),
        ];
        Board::new("walk", 3, &seen, 11 * SECOND)
    }

    fn standing(pid: Option<u32>, metrics: Option<&messages::Metrics>, now: u64) -> Standing {
        let process = "pose-0";
        Member::new(
            &ObservedProcess {
                process,
                pid,
                metrics,
            },
            now,
        )
        .standing
    }

    #[test]
    fn processes_stand_in_the_way_of_a_frame_and_by_number() {
        let names: Vec<String> = board().members.into_iter().map(|it| it.process).collect();
        assert_eq!(names, ["capture-9", "capture-10", "pose-0", "results"]);
    }

    #[test]
    fn who_lives_and_speaks_runs_until_it_is_done() {
        let mut it = said(17, None);
        let now = 11 * SECOND;
        assert_eq!(standing(Some(17), Some(&it), now), Standing::Runs);
        it.finished = 1;
        assert_eq!(standing(Some(17), Some(&it), now), Standing::Done);
    }

    #[test]
    fn who_does_not_live_is_dead_whatever_it_said() {
        let it = said(17, None);
        assert_eq!(standing(None, Some(&it), 11 * SECOND), Standing::Dead);
        assert_eq!(standing(None, None, 11 * SECOND), Standing::Dead);
    }

    #[test]
    fn words_of_an_earlier_life_do_not_count() {
        let it = said(16, None);
        assert_eq!(standing(Some(17), Some(&it), 11 * SECOND), Standing::Begins);
        assert_eq!(standing(Some(17), None, 11 * SECOND), Standing::Begins);
    }

    #[test]
    fn who_says_nothing_for_five_seconds_is_silent() {
        let it = said(17, None);
        assert_eq!(standing(Some(17), Some(&it), 15 * SECOND), Standing::Runs);
        assert_eq!(standing(Some(17), Some(&it), 16 * SECOND), Standing::Silent);
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        let mut it = said(17, None);
        it.n_rows = 1000;
        let process = "pose-0";
        let sighting = ObservedProcess {
            process,
            pid: Some(17),
            metrics: Some(&it),
        };
        let member = Member::new(&sighting, 11 * SECOND);
        assert_eq!(
            member.problem,
            Some(ReadingError::TooManyRows { rows: 1000 })
        );
        assert!(member.reading.is_none());
    }

    #[test]
    fn views_are_called_as_their_processes_call_them() {
        assert_eq!(board().views(), [(0, "left")].into());
    }
}
