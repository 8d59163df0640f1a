//! A long run, part by part: how late its results were, and what it held.

use core::fmt::Write as _;
use core::ops::Range;

use serde::Serialize;

use super::barrage::Kill;
use super::census::{Census, Sample};
use crate::spread::Spread;
use crate::trial::results::Moment;

/// A part of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Part {
    /// When it began, seconds since the run was planned.
    pub from_s: f64,
    /// Processes that were killed.
    pub kills: usize,
    /// Results that were sent.
    pub results: usize,
    /// From the capture of the first picture to the sending of the result, milliseconds.
    pub end_to_end_ms: Option<Spread>,
    /// What was held: the median; none if there was no second in which all processes worked.
    pub held: Option<Sample>,
}

/// Divides a run into parts of a length.
///
/// * `length`: of a part, nanoseconds; the last one may be shorter.
/// * `session`: when the run was planned, `runtime::now_nanos`.
pub(super) fn parts(
    length: u64,
    session: u64,
    kills: &[Kill],
    census: &Census,
    moments: &[Moment],
) -> Vec<Part> {
    let sent = |it: &Moment| session + (it.sent_ms * 1e6) as u64;
    let end = moments.iter().map(sent).max().unwrap_or(session);
    let begins = (session..=end).step_by(length.max(1) as usize);
    let part = |from: u64| {
        let span: Range<u64> = from..from + length.max(1);
        let killed = kills.iter().filter_map(|it| it.times.killed);
        let of_part = moments.iter().filter(|it| span.contains(&sent(it)));
        let late = |it: &Moment| Some(it.sent_ms - it.captured_ms()?);
        Part {
            from_s: (from - session) as f64 / 1e9,
            kills: killed.filter(|it| span.contains(it)).count(),
            results: of_part.clone().count(),
            end_to_end_ms: Spread::of(of_part.filter_map(late).collect()),
            held: census.within(&span),
        }
    };
    begins.map(part).collect()
}

/// A table of the parts, a line each; nothing of a single one.
pub(super) fn table(parts: &[Part]) -> Vec<String> {
    if parts.len() < 2 {
        return Vec::new();
    }
    let head = "  from s  kills  results   p50 ms   p99 ms  p99.9 ms   max ms  memory MB  shared MB  descriptors  files";
    let lines = parts.iter().map(|it| {
        let mut line = format!("{:>8.0}{:>7}{:>9}", it.from_s, it.kills, it.results);
        let late = Spread::cells(it.end_to_end_ms, 0);
        let held = it.held.map(|held| {
            let mb = |bytes: u64| format!("{:.1}", bytes as f64 / 1e6);
            let memory = held.memory_bytes + held.supervisor_memory_bytes;
            let [memory, shared] = [memory, held.shared_bytes].map(mb);
            [
                memory,
                shared,
                held.descriptors.to_string(),
                held.files.to_string(),
            ]
        });
        let held = held.unwrap_or_else(|| ["-"; 4].map(str::to_owned));
        for (cell, width) in late.iter().chain(&held).zip([9, 9, 10, 9, 11, 11, 13, 7]) {
            // Writing to a string cannot fail.
            let _infallible = write!(line, "{cell:>width$}");
        }
        line
    });
    core::iter::once(head.to_owned()).chain(lines).collect()
}

#[cfg(test)]
mod tests {
    use runfiles::CameraTimes;
    use supervise::Event;

    use super::*;
    use crate::trial::results::Seen;
    use crate::trial::strike::Times;

    const SECOND: u64 = 1_000_000_000;
    const SESSION: u64 = 50 * SECOND;

    fn moment(captured_s: f64, sent_s: f64) -> Moment {
        let [captured_ms, sent_ms] = [captured_s, sent_s].map(|it| it * 1000.0);
        let shot = CameraTimes {
            epoch: 0,
            captured_ms,
            sent_ms: captured_ms,
        };
        let seen = Seen {
            shot: Some(shot),
            ..Seen::default()
        };
        Moment {
            frame: 0,
            epoch: 0,
            sent_ms,
            joints: Vec::new(),
            views: vec![seen],
        }
    }

    fn kill(at_s: u64) -> Kill {
        let times = Times {
            killed: Some(SESSION + at_s * SECOND),
            ..Times::default()
        };
        Kill {
            process: "pose-1".to_owned(),
            times,
            life: 1,
        }
    }

    /// One process, of which a sample is taken at some seconds.
    fn census(at_s: &[u64]) -> Census {
        let mut census = Census::default();
        let event = Event::Started {
            process: "pose-1",
            pid: 7,
            epoch: 0,
        };
        census.note(&event, SESSION, |_| Sample::default());
        let health = messages::Health {
            n_sent: 1,
            ..messages::Health::default()
        };
        for seconds in at_s {
            let event = Event::Health {
                process: "pose-1",
                health: &health,
            };
            census.note(&event, SESSION + seconds * SECOND, |_| Sample {
                files: *seconds,
                ..Sample::default()
            });
        }
        census
    }

    #[test]
    fn everything_counts_in_the_part_in_which_it_happened() {
        let moments = [moment(1.0, 1.2), moment(9.9, 10.4), moment(24.0, 24.3)];
        let kills = [kill(3), kill(12), kill(14)];
        let parts = parts(10 * SECOND, SESSION, &kills, &census(&[2, 13]), &moments);
        let got: Vec<_> = parts
            .iter()
            .map(|it| (it.from_s, it.kills, it.results, it.held.map(|it| it.files)))
            .collect();
        let expected = [
            (0.0, 1, 1, Some(2)),
            (10.0, 2, 1, Some(13)),
            (20.0, 0, 1, None),
        ];
        assert_eq!(got, expected);
        let late = parts[1].end_to_end_ms.unwrap().max;
        assert!((late - 500.0).abs() < 1e-6, "{late}");
    }

    #[test]
    fn a_run_of_one_part_needs_no_table_and_others_have_a_line_for_each() {
        let moments = [moment(1.0, 1.2), moment(24.0, 24.3)];
        let census = census(&[2]);
        let of = |seconds: u64| parts(seconds * SECOND, SESSION, &[], &census, &moments);
        assert_eq!(table(&of(60)), [""; 0]);
        let lines = table(&of(20));
        assert_eq!(lines.len(), 3, "{lines:?}");
        let cells: Vec<&str> = lines[2].split_whitespace().collect();
        assert_eq!(
            cells,
            [
                "20", "0", "1", "300", "300", "300", "300", "-", "-", "-", "-"
            ]
        );
        assert!(
            lines.iter().all(|it| it.len() == lines[0].len()),
            "{lines:#?}"
        );
    }
}
