//! A snapshot of a deployment as text: a table of the processes, and a table of their times.

use failure::wording::Table;
use messages::{Cause, UNMEASURED};
use runtime::metrics::{Reading, Timed};

use super::snapshot::{ProcessSnapshot, Snapshot, State};

/// Cell for an unknown value.
const NONE: &str = "-";

/// Formats a deployment as two tables. The titles contain the units.
pub fn table(snapshot: &Snapshot) -> String {
    let alive = snapshot.processes.iter().filter(|process| process.pid.is_some()).count();
    let mut text = format!(
        "{}: run by process {}, {alive} of {} processes alive\n\n",
        snapshot.name,
        snapshot.supervisor,
        snapshot.processes.len()
    );
    let rows = snapshot.processes.iter().map(|process| process_row(snapshot, process));
    push_table(&mut text, &PROCESSES, rows);
    let problems = snapshot.processes.iter().filter_map(|process| {
        let problem = process.problem?;
        Some(format!("{} cannot be read: {problem}\n", process.name))
    });
    text.extend(problems);
    text.push('\n');
    text.push_str(&cameras(snapshot));
    let counted = snapshot.processes.iter().filter_map(|process| {
        let n = process.reading.as_ref()?.n_people?;
        Some(format!("people in view: {n} (one of them is followed)\n\n"))
    });
    text.extend(counted);
    let rows = snapshot.processes.iter().flat_map(|process| time_rows(snapshot, process));
    push_table(&mut text, &TIMES, rows);
    text
}

const CAMERAS: [&str; 13] = [
    "<CAMERA",
    "OPENED",
    "TAKEN",
    "LOST",
    "USED",
    "SURPLUS",
    "OVERTAKEN",
    "REFUSED",
    "RATE Hz",
    "SKEW ms",
    "DRIFT ppm",
    "DELAY ms",
    "<TIMED BY",
];

/// Returns the table of live cameras' pictures; empty if there are no live cameras.
fn cameras(snapshot: &Snapshot) -> String {
    let rows: Vec<Vec<String>> = snapshot
        .processes
        .iter()
        .filter_map(|process| {
            let reading = process.reading.as_ref()?;
            let it = reading.camera?;
            let index = reading.view.as_ref().map(|view| view.index);
            let mut row =
                vec![index.map_or_else(|| process.name.clone(), |index| view(snapshot, index))];
            row.extend(
                [
                    it.n_connections,
                    it.n_made,
                    it.n_lost,
                    it.n_used,
                    it.n_surplus,
                    it.n_overtaken,
                    it.n_refused,
                ]
                .map(|count| count.to_string()),
            );
            row.push(if it.rate_microhertz > 0 {
                format!("{:.3}", it.rate_microhertz as f64 / 1e6)
            } else {
                NONE.to_owned()
            });
            for (value, per) in [
                (it.skew_nanos, 1e6),
                (it.drift_ppb, 1e3),
                (it.delay_nanos, 1e6),
            ] {
                row.push(if value == UNMEASURED {
                    NONE.to_owned()
                } else {
                    format!("{:+.1}", value as f64 / per)
                });
            }
            row.push(it.timed_by.name().to_owned());
            Some(row)
        })
        .collect();
    let mut text = String::new();
    if !rows.is_empty() {
        push_table(&mut text, &CAMERAS, rows);
        text.push('\n');
    }
    text
}

/// Column titles; `<` marks a left-aligned column.
const PROCESSES: [&str; 11] = [
    "<PROCESS",
    "<VIEW",
    "<STATE",
    "UP s",
    "SENT",
    "SENT/s",
    "RESTARTS",
    "QUEUE of MOST",
    "MEMORY MB",
    "EVIDENCE MB",
    "<DROPPED",
];

fn process_row(snapshot: &Snapshot, process: &ProcessSnapshot) -> Vec<String> {
    let reading = process.reading.as_ref();
    let or_none = |value: Option<String>| value.unwrap_or_else(|| NONE.to_owned());
    let is_active = matches!(process.state, State::Running | State::Done);
    let megabytes = |bytes: u64| format!("{:.1}", bytes as f64 / 1e6);
    let uptime = |reading: &Reading| {
        format!(
            "{:.0}",
            (reading.at_nanos - reading.began_at_nanos) as f64 / 1e9
        )
    };
    vec![
        process.name.clone(),
        or_none(
            reading
                .and_then(|reading| reading.view.as_ref())
                .map(|shown| view(snapshot, shown.index)),
        ),
        process.state.name().to_owned(),
        or_none(reading.filter(|_| is_active).map(uptime)),
        or_none(reading.map(|reading| reading.n_sent.to_string())),
        or_none(reading.filter(|_| is_active).map(|reading| rate(reading.sent_millihertz))),
        or_none(reading.map(|reading| reading.restarts.to_string())),
        or_none(
            reading
                .and_then(|reading| reading.queue)
                .map(|queue| format!("{} of {}", queue[0], queue[1])),
        ),
        or_none(
            reading
                .filter(|reading| reading.memory_bytes > 0)
                .map(|reading| megabytes(reading.memory_bytes)),
        ),
        or_none(
            reading
                .filter(|reading| reading.evidence_bytes > 0)
                .map(|reading| megabytes(reading.evidence_bytes)),
        ),
        or_none(reading.map(dropped)),
    ]
}

/// Returns the counts of dropped messages by cause, without zeros; `none` if nothing was dropped.
fn dropped(reading: &Reading) -> String {
    let causes: Vec<String> = Cause::ALL
        .into_iter()
        .filter(|cause| reading.n_dropped_by(*cause) > 0)
        .map(|cause| format!("{} {}", reading.n_dropped_by(cause), cause.name()))
        .collect();
    if causes.is_empty() {
        "none".to_owned()
    } else {
        causes.join(", ")
    }
}

const TIMES: [&str; 9] = [
    "<PROCESS", "<STAGE", "<VIEW", "COUNT", "PER s", "p50 ms", "p99 ms", "p99.9 ms", "max ms",
];

/// Returns one row per kind of time and view. Only the first row has the name of the process.
fn time_rows(snapshot: &Snapshot, process: &ProcessSnapshot) -> Vec<Vec<String>> {
    let Some(reading) = &process.reading else {
        return Vec::new();
    };
    let mut sorted: Vec<&Timed> = reading.times.iter().collect();
    sorted.sort_by_key(|timed| (timed.span, timed.view));
    let own_view = reading.view.as_ref().map(|view| view.index);
    let rows = sorted.into_iter().enumerate().map(|(nth, timed)| {
        let ms = [
            timed.p50_nanos,
            timed.p99_nanos,
            timed.p99_9_nanos,
            timed.max_nanos,
        ];
        let name = if nth == 0 { process.name.as_str() } else { "" };
        let index = timed.view.or(own_view);
        let mut row = vec![
            name.to_owned(),
            timed.span.name().to_owned(),
            index.map_or_else(|| "all".to_owned(), |index| view(snapshot, index)),
            timed.count.to_string(),
            rate(timed.millihertz),
        ];
        row.extend(ms.map(milliseconds));
        row
    });
    rows.collect()
}

/// Returns the name of a view, or its number if the name is unknown.
fn view(snapshot: &Snapshot, index: usize) -> String {
    let name = snapshot.views().get(&index).map(|view| (*view).to_owned());
    name.unwrap_or_else(|| format!("view {index}"))
}

/// Formats a rate in hertz: two decimals below 10, otherwise one.
fn rate(millihertz: u64) -> String {
    let hertz = millihertz as f64 / 1e3;
    if hertz < 10.0 {
        format!("{hertz:.2}")
    } else {
        format!("{hertz:.1}")
    }
}

/// Formats a time in milliseconds: three decimals below 10, otherwise one.
fn milliseconds(nanos: u64) -> String {
    let ms = nanos as f64 / 1e6;
    if ms < 10.0 {
        format!("{ms:.3}")
    } else {
        format!("{ms:.1}")
    }
}

/// Appends a table.
fn push_table(text: &mut String, titles: &[&str], rows: impl IntoIterator<Item = Vec<String>>) {
    let mut table = Table::new(titles.iter().copied());
    for row in rows {
        table.row(row);
    }
    text.push_str(&table.to_string());
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::super::snapshot::tests::snapshot;
    use super::*;

    #[test]
    fn a_deployment_is_shown_as_two_tables() {
        let expected = "\
walk: run by process 3, 3 of 4 processes alive

PROCESS     VIEW  STATE   UP s  SENT  SENT/s  RESTARTS  QUEUE of MOST  MEMORY MB  EVIDENCE MB  DROPPED
capture-9   -     begins     -     -       -         -              -          -            -  -
capture-10  -     dead       -     -       -         -              -          -            -  -
pose-0      left  runs       6   100    20.0         1         2 of 2       48.2          7.3  3 late
results     -     runs       6   100    20.0         1         2 of 2       48.2          7.3  3 late

PROCESS  STAGE       VIEW    COUNT  PER s  p50 ms  p99 ms  p99.9 ms  max ms
pose-0   waiting     left      100   20.0   0.060   0.060     0.060   0.060
         waiting     view 1      1   20.0  3003.1  3003.1    3003.1  3003.1
         computing   left      100   20.0    50.1    99.1     100.1   100.1
         publishing  left      100   20.0   0.003   0.003     0.003   0.003
results  waiting     all       100   20.0  ";
        let text = table(&snapshot());
        assert!(text.starts_with(expected), "{text}");
    }

    #[test]
    fn the_number_of_people_is_shown_for_processes_that_count_people() {
        let mut snapshot = snapshot();
        assert!(!table(&snapshot).contains("people"));
        snapshot.processes[3].reading.as_mut().unwrap().n_people = Some(3);
        let text = table(&snapshot);
        assert!(
            text.contains("people in view: 3 (one of them is followed)\n"),
            "{text}"
        );
    }

    #[test]
    fn skew_and_drift_of_a_live_camera_are_shown_once_they_are_measured() {
        let mut snapshot = snapshot();
        let camera = messages::CameraCounts {
            n_connections: 1,
            skew_nanos: -3_200_000,
            drift_ppb: UNMEASURED,
            delay_nanos: 41_000_000,
            timed_by: messages::TimedBy::CAMERA,
            ..messages::CameraCounts::default()
        };
        snapshot.processes[2].reading.as_mut().unwrap().camera = Some(camera);
        let text = table(&snapshot);
        let line = text.lines().find(|line| line.starts_with("left")).unwrap();
        assert!(
            line.ends_with("-3.2          -     +41.0  camera"),
            "{text}"
        );
    }

    #[test]
    fn columns_are_aligned_with_their_titles() {
        let text = table(&snapshot());
        let lines: Vec<&str> = text.lines().collect();
        let title = lines[2].find("DROPPED").unwrap();
        for line in &lines[3..7] {
            assert!(line.is_char_boundary(title), "{line}");
            assert_eq!(&line[title - 2..title], "  ", "{line}");
            assert_ne!(&line[title..=title], " ", "{line}");
        }
    }

    #[test]
    fn dropped_messages_are_shown_by_cause() {
        let mut snapshot = snapshot();
        let reading = snapshot.processes[2].reading.as_mut().unwrap();
        reading.n_dropped = [1, 0, 0, 0, 2];
        assert_eq!(dropped(reading), "1 behind clock, 2 malformed");
        reading.n_dropped = [0; 5];
        assert_eq!(dropped(reading), "none");
    }

    #[test]
    fn short_times_are_shown_in_microseconds_and_long_times_are_not() {
        assert_eq!(milliseconds(1_234), "0.001");
        assert_eq!(milliseconds(9_999_400), "9.999");
        assert_eq!(milliseconds(12_345_678), "12.3");
    }

    #[test]
    fn small_rates_have_two_decimals() {
        assert_eq!([50, 9_990, 19_960].map(rate), ["0.05", "9.99", "20.0"]);
    }

    #[test]
    fn invalid_metrics_are_shown_with_the_reason() {
        let mut snapshot = snapshot();
        snapshot.processes[2].reading = None;
        snapshot.processes[2].problem = Some(runtime::metrics::ReadingError::Name);
        let text = table(&snapshot);
        assert!(text.contains("pose-0 cannot be read: the name"), "{text}");
    }
}
