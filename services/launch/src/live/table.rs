//! Times and counts for people: two tables, of processes and of what their time went into.

use core::fmt::Write as _;

use messages::Cause;
use metrics::{Reading, Timed};

use super::board::{Board, Member, Standing};

/// What is not known.
const NONE: &str = "-";

/// A deployment as lines of text. Every cell stands under its title, whose unit it is in.
pub fn table(board: &Board) -> String {
    let alive = board.members.iter().filter(|it| it.pid.is_some()).count();
    let mut text = format!(
        "{}: run by process {}, {alive} of {} processes live\n\n",
        board.name,
        board.supervisor,
        board.members.len()
    );
    let rows = board.members.iter().map(|it| process(board, it));
    push(&mut text, &PROCESSES, &rows.collect::<Vec<_>>());
    let problems = board.members.iter().filter_map(|it| {
        let problem = it.problem?;
        Some(format!("{} cannot be read: {problem}\n", it.process))
    });
    text.extend(problems);
    text.push('\n');
    let rows = board.members.iter().flat_map(|it| times(board, it));
    push(&mut text, &TIMES, &rows.collect::<Vec<_>>());
    text
}

/// Titles; those that begin with `<` stand to the left of their columns.
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

fn process(board: &Board, it: &Member) -> Vec<String> {
    let said = it.reading.as_ref();
    let or_none = |value: Option<String>| value.unwrap_or_else(|| NONE.to_owned());
    let lives = matches!(it.standing, Standing::Runs | Standing::Done);
    let megabytes = |bytes: u64| format!("{:.1}", bytes as f64 / 1e6);
    let up = |it: &Reading| format!("{:.0}", (it.at_nanos - it.began_at_nanos) as f64 / 1e9);
    vec![
        it.process.clone(),
        or_none(
            said.and_then(|it| it.view.as_ref())
                .map(|it| view(board, it.index)),
        ),
        it.standing.name().to_owned(),
        or_none(said.filter(|_| lives).map(up)),
        or_none(said.map(|it| it.n_sent.to_string())),
        or_none(said.filter(|_| lives).map(|it| rate(it.sent_millihertz))),
        or_none(said.map(|it| it.restarts.to_string())),
        or_none(
            said.and_then(|it| it.queue)
                .map(|it| format!("{} of {}", it[0], it[1])),
        ),
        or_none(
            said.filter(|it| it.memory_bytes > 0)
                .map(|it| megabytes(it.memory_bytes)),
        ),
        or_none(
            said.filter(|it| it.evidence_bytes > 0)
                .map(|it| megabytes(it.evidence_bytes)),
        ),
        or_none(said.map(dropped)),
    ]
}

/// `none`, or how many for every cause that there was.
fn dropped(it: &Reading) -> String {
    let there_was = Cause::ALL
        .into_iter()
        .filter(|cause| it.n_dropped_by(*cause) > 0);
    let causes: Vec<String> = there_was
        .map(|cause| format!("{} {}", it.n_dropped_by(cause), cause.name()))
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

/// One row for every stage and view; the name of the process stands in the first.
fn times(board: &Board, it: &Member) -> Vec<Vec<String>> {
    let Some(said) = &it.reading else {
        return Vec::new();
    };
    let mut sorted: Vec<&Timed> = said.times.iter().collect();
    sorted.sort_by_key(|it| (it.span, it.view));
    let own = said.view.as_ref().map(|it| it.index);
    let rows = sorted.into_iter().enumerate().map(|(nth, timed)| {
        let ms = [
            timed.p50_nanos,
            timed.p99_nanos,
            timed.p99_9_nanos,
            timed.max_nanos,
        ];
        let name = if nth == 0 { it.process.as_str() } else { "" };
        let of = timed.view.or(own);
        let mut row = vec![
            name.to_owned(),
            timed.span.name().to_owned(),
            of.map_or_else(|| "all".to_owned(), |it| view(board, it)),
            timed.count.to_string(),
            rate(timed.millihertz),
        ];
        row.extend(ms.map(milliseconds));
        row
    });
    rows.collect()
}

/// A view by name, or by number from 0 where nobody has said its name.
fn view(board: &Board, index: usize) -> String {
    let name = board.views().get(&index).map(|it| (*it).to_owned());
    name.unwrap_or_else(|| format!("view {index}"))
}

/// Two digits after the point of what is rare, one of what is not.
fn rate(millihertz: u64) -> String {
    let hertz = millihertz as f64 / 1e3;
    if hertz < 10.0 {
        format!("{hertz:.2}")
    } else {
        format!("{hertz:.1}")
    }
}

/// Three digits after the point of what is short, one of what is long.
fn milliseconds(nanos: u64) -> String {
    let ms = nanos as f64 / 1e6;
    if ms < 10.0 {
        format!("{ms:.3}")
    } else {
        format!("{ms:.1}")
    }
}

/// Appends a table whose columns are as wide as they need to be.
fn push<const N: usize>(text: &mut String, titles: &[&str; N], rows: &[Vec<String>]) {
    let width_of = |cell: &str| cell.chars().count();
    let widths: [usize; N] = core::array::from_fn(|column| {
        let title = width_of(titles[column].trim_start_matches('<'));
        let cells = rows.iter().map(|row| width_of(&row[column]));
        cells.fold(title, usize::max)
    });
    let head = titles
        .map(|it| it.trim_start_matches('<').to_owned())
        .to_vec();
    for row in core::iter::once(&head).chain(rows) {
        let mut line = String::new();
        for ((cell, title), width) in row.iter().zip(titles).zip(widths) {
            // Writing to a string cannot fail.
            let _infallible = if title.starts_with('<') {
                write!(line, "{cell:<width$}  ")
            } else {
                write!(line, "{cell:>width$}  ")
            };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::super::board::tests::board;
    use super::*;

    #[test]
    fn a_deployment_reads_as_two_tables() {
        let expected = "\
walk: run by process 3, 3 of 4 processes live

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
        let text = table(&board());
        let same = text
            .chars()
            .zip(expected.chars())
            .take_while(|it| it.0 == it.1);
        let same = same.count();
        assert_eq!(same, expected.chars().count(), "{text}");
    }

    #[test]
    fn every_cell_stands_under_its_title() {
        let text = table(&board());
        let lines: Vec<&str> = text.lines().collect();
        let title = lines[2].find("DROPPED").unwrap();
        for line in &lines[3..7] {
            assert!(line.is_char_boundary(title), "{line}");
            assert_eq!(&line[title - 2..title], "  ", "{line}");
            assert_ne!(&line[title..=title], " ", "{line}");
        }
    }

    #[test]
    fn what_was_lost_is_told_by_cause() {
        let mut board = board();
        let reading = board.members[2].reading.as_mut().unwrap();
        reading.n_dropped = [1, 0, 0, 0, 2];
        assert_eq!(dropped(reading), "1 behind clock, 2 malformed");
        reading.n_dropped = [0; 5];
        assert_eq!(dropped(reading), "none");
    }

    #[test]
    fn short_times_have_microseconds_and_long_ones_do_not() {
        assert_eq!(milliseconds(1_234), "0.001");
        assert_eq!(milliseconds(9_999_400), "9.999");
        assert_eq!(milliseconds(12_345_678), "12.3");
    }

    #[test]
    fn rare_things_have_a_rate_too() {
        assert_eq!([50, 9_990, 19_960].map(rate), ["0.05", "9.99", "20.0"]);
    }

    #[test]
    fn what_cannot_be_read_is_told_with_the_reason() {
        let mut board = board();
        board.members[2].reading = None;
        board.members[2].problem = Some(metrics::ReadingError::Name);
        let text = table(&board);
        assert!(text.contains("pose-0 cannot be read: the name"), "{text}");
    }
}
