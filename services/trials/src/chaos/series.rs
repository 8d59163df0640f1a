//! Divides the report of a long run into parts, with the latency, kills and resources of each part.

use core::ops::Range;

use failure::wording::Table;
use serde::Serialize;

use super::random_kills::Kill;
use super::resources::{ResourceMonitor, ResourceUse};
use crate::spread::Spread;
use crate::trial::results::FrameResult;

/// The measurements of one part of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Part {
    /// Start of the part, in seconds since the planning of the run.
    pub from_s: f64,
    /// Number of kills.
    pub kills: usize,
    /// Number of results.
    pub results: usize,
    /// Time from the capture of the first picture to the result, in milliseconds.
    pub end_to_end_ms: Option<Spread>,
    /// Medians of the resources; `None` if there was no second in which all processes worked.
    #[serde(rename = "held")]
    pub resources: Option<ResourceUse>,
}

/// Divides a run into parts.
///
/// * `length`: the length of a part, in nanoseconds; the last part may be shorter.
/// * `session`: the session, which is the time of planning (`failure::now_nanos`).
pub(super) fn parts(
    length: u64,
    session: u64,
    kills: &[Kill],
    monitor: &ResourceMonitor,
    results: &[FrameResult],
) -> Vec<Part> {
    let sent = |frame_result: &FrameResult| session + (frame_result.sent_ms * 1e6) as u64;
    let end = results.iter().map(sent).max().unwrap_or(session);
    let begins = (session..=end).step_by(length.max(1) as usize);
    let part = |from: u64| {
        let span: Range<u64> = from..from + length.max(1);
        let killed = kills.iter().filter_map(|kill| kill.times.injected);
        let of_part = results.iter().filter(|result| span.contains(&sent(result)));
        let latency = |result: &FrameResult| Some(result.sent_ms - result.captured_ms()?);
        Part {
            from_s: (from - session) as f64 / 1e9,
            kills: killed.filter(|killed| span.contains(killed)).count(),
            results: of_part.clone().count(),
            end_to_end_ms: Spread::of(of_part.filter_map(latency).collect()),
            resources: monitor.within(&span),
        }
    };
    begins.map(part).collect()
}

/// Returns the parts as a table with a header and one line per part. Returns an empty list for a single part.
pub(super) fn table(parts: &[Part]) -> Vec<String> {
    if parts.len() < 2 {
        return Vec::new();
    }
    let mut table = Table::new([
        "from s",
        "kills",
        "results",
        "p50 ms",
        "p99 ms",
        "p99.9 ms",
        "max ms",
        "memory MB",
        "shared MB",
        "descriptors",
        "files",
    ]);
    for part in parts {
        let counts = [
            format!("{:.0}", part.from_s),
            part.kills.to_string(),
            part.results.to_string(),
        ];
        let resources = part.resources.map(|used| {
            let mb = |bytes: u64| format!("{:.1}", bytes as f64 / 1e6);
            let memory = used.memory_bytes + used.supervisor_memory_bytes;
            let [memory, shared] = [memory, used.shared_bytes].map(mb);
            [
                memory,
                shared,
                used.descriptors.to_string(),
                used.files.to_string(),
            ]
        });
        let resources = resources.unwrap_or_else(|| ["-"; 4].map(str::to_owned));
        let latency = Spread::cells(part.end_to_end_ms, 0);
        table.row(counts.into_iter().chain(latency).chain(resources));
    }
    table.lines()
}

#[cfg(test)]
mod tests {
    use runfiles::CameraTimes;
    use supervise::Event;

    use super::*;
    use crate::chaos::resources::Measured;
    use crate::trial::injection::FaultTimes;
    use crate::trial::results::ViewResult;

    const SECOND: u64 = 1_000_000_000;
    const SESSION: u64 = 50 * SECOND;

    fn moment(captured_s: f64, sent_s: f64) -> FrameResult {
        let [captured_ms, sent_ms] = [captured_s, sent_s].map(|value| value * 1000.0);
        let camera = CameraTimes {
            epoch: 0,
            captured_ms,
            sent_ms: captured_ms,
        };
        let view = ViewResult {
            camera: Some(camera),
            ..ViewResult::default()
        };
        FrameResult {
            frame: 0,
            epoch: 0,
            sent_ms,
            people: Vec::new(),
            views: vec![view],
        }
    }

    fn kill(at_s: u64) -> Kill {
        let times = FaultTimes {
            injected: Some(SESSION + at_s * SECOND),
            ..FaultTimes::default()
        };
        Kill {
            process: "pose-1".to_owned(),
            times,
            epoch: 1,
        }
    }

    /// Returns a monitor of one process with samples at the given seconds.
    fn monitor(at_s: &[u64]) -> ResourceMonitor {
        let mut monitor = ResourceMonitor::default();
        let event = Event::Started {
            process: "pose-1",
            pid: 7,
            epoch: 0,
        };
        monitor.handle(&event, SESSION, |_| Measured::default());
        let health = messages::Health {
            n_sent: 1,
            ..messages::Health::default()
        };
        for seconds in at_s {
            let event = Event::Health {
                process: "pose-1",
                health: &health,
            };
            let used = ResourceUse {
                files: *seconds,
                ..ResourceUse::default()
            };
            monitor.handle(&event, SESSION + seconds * SECOND, |_| Measured {
                used,
                memory_bytes: Vec::new(),
            });
        }
        monitor
    }

    #[test]
    fn results_and_kills_and_samples_count_in_their_section_of_the_run() {
        let results = [moment(1.0, 1.2), moment(9.9, 10.4), moment(24.0, 24.3)];
        let kills = [kill(3), kill(12), kill(14)];
        let parts = parts(10 * SECOND, SESSION, &kills, &monitor(&[2, 13]), &results);
        let got: Vec<_> = parts
            .iter()
            .map(|part| {
                (
                    part.from_s,
                    part.kills,
                    part.results,
                    part.resources.map(|resource| resource.files),
                )
            })
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
    fn a_run_with_one_section_has_no_table_and_others_have_a_row_per_section() {
        let results = [moment(1.0, 1.2), moment(24.0, 24.3)];
        let monitor = monitor(&[2]);
        let of = |seconds: u64| parts(seconds * SECOND, SESSION, &[], &monitor, &results);
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
            lines.iter().all(|line| line.len() == lines[0].len()),
            "{lines:#?}"
        );
    }
}
