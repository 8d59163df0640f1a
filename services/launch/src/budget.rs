//! Whether a run was as fast as it was asked to be.

use core::fmt::Write as _;

use runfiles::{LatencyReport, Percentiles};
use serde_json::{Value, json};

/// The longest time from capture to result that 99 of 100 frames may take, and what they took.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// What was asked for, milliseconds.
    limit_ms: f64,
    /// Frames that were measured.
    n_frames: u64,
    /// What they took, milliseconds; none where nothing was measured.
    p99_ms: Option<f64>,
    /// Percentiles of all stages, as text.
    table: String,
}

impl Budget {
    /// Judges a run.
    ///
    /// * `latency`: where the time went; none if that is not known.
    pub fn new(limit_ms: f64, latency: Option<&LatencyReport>) -> Self {
        let measured = latency.map(|it| it.end_to_end);
        let measured = measured.filter(|it| it.count > 0);
        Self {
            limit_ms,
            n_frames: measured.map_or(0, |it| it.count),
            p99_ms: measured.map(|it| it.p99_ms),
            table: latency.map_or_else(String::new, table),
        }
    }

    /// Whether frames were measured, and were fast enough.
    pub fn is_held(&self) -> bool {
        self.p99_ms.is_some_and(|it| it <= self.limit_ms)
    }

    /// Whether frames were measured, and were too slow.
    pub fn is_exceeded(&self) -> bool {
        self.p99_ms.is_some() && !self.is_held()
    }

    /// In one line.
    pub fn verdict(&self) -> String {
        let Self {
            limit_ms, n_frames, ..
        } = self;
        match self.p99_ms {
            None => format!("{limit_ms} ms could not be judged: no frame has an end-to-end time"),
            Some(p99) if self.is_held() => {
                format!("{limit_ms} ms held: p99 end to end is {p99:.1} ms of {n_frames} frames")
            }
            Some(p99) => {
                format!("{limit_ms} ms missed: p99 end to end is {p99:.1} ms of {n_frames} frames")
            }
        }
    }

    /// The same with where the time went, for a run that fails by it.
    pub fn complaint(&self) -> String {
        let text = format!("latency budget of {}", self.verdict());
        if self.table.is_empty() {
            text
        } else {
            format!("{text}\n{}", self.table.trim_end())
        }
    }

    /// For programs.
    pub fn json(&self) -> Value {
        json!({
            "budget_ms": self.limit_ms,
            "p99_ms": self.p99_ms,
            "frames": self.n_frames,
            "held": self.is_held(),
        })
    }
}

/// Percentiles of every stage and of the whole, with a title; empty where nothing was measured.
pub fn table(latency: &LatencyReport) -> String {
    let mut text = String::new();
    for (name, it) in rows(latency).filter(|(_, it)| it.count > 0) {
        if text.is_empty() {
            let titles = ["p50", "p99", "p99.9", "max"];
            row(&mut text, "  latency, ms", titles.map(str::to_owned));
        }
        let times = [it.p50_ms, it.p99_ms, it.p99_9_ms, it.max_ms];
        let cells = times.map(|ms| format!("{ms:.1}"));
        row(&mut text, &format!("    {name}"), cells);
    }
    text
}

/// The stages that were measured, in the order of the data, and the whole.
pub fn rows(latency: &LatencyReport) -> impl Iterator<Item = (&'static str, Percentiles)> {
    let names = ["capture", "pose", "quality", "fuse", "triangulate"].into_iter();
    let stages = names.filter_map(|name| Some((name, *latency.stages.get(name)?)));
    stages.chain([("end to end", latency.end_to_end)])
}

fn row(text: &mut String, name: &str, cells: [String; 4]) {
    let [p50, p99, p99_9, max] = cells;
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "{name:<15} {p50:>9} {p99:>9} {p99_9:>9} {max:>9}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn latency(count: u64) -> LatencyReport {
        let end_to_end = Percentiles {
            count,
            max_ms: 123.0,
            p50_ms: 20.0,
            p99_9_ms: 60.04,
            p99_ms: 50.0,
        };
        LatencyReport {
            end_to_end,
            stages: [("pose".to_owned(), end_to_end)].into(),
            ..LatencyReport::default()
        }
    }

    #[test]
    fn a_run_as_slow_as_it_may_be_holds_its_budget() {
        let budget = Budget::new(50.0, Some(&latency(100)));
        assert!(budget.is_held() && !budget.is_exceeded());
        assert_eq!(
            budget.verdict(),
            "50 ms held: p99 end to end is 50.0 ms of 100 frames"
        );
    }

    #[test]
    fn a_slower_one_misses_it_and_says_where_the_time_went() {
        let budget = Budget::new(49.9, Some(&latency(100)));
        assert!(budget.is_exceeded());
        let expected = "\
latency budget of 49.9 ms missed: p99 end to end is 50.0 ms of 100 frames
  latency, ms         p50       p99     p99.9       max
    pose             20.0      50.0      60.0     123.0
    end to end       20.0      50.0      60.0     123.0";
        assert_eq!(budget.complaint(), expected);
        assert_eq!(budget.json()["held"], false);
    }

    #[test]
    fn what_was_not_measured_is_neither_held_nor_exceeded() {
        for latency in [None, Some(LatencyReport::default()), Some(latency(0))] {
            let budget = Budget::new(1e9, latency.as_ref());
            assert!(!budget.is_held() && !budget.is_exceeded(), "{latency:?}");
            assert!(budget.complaint().contains("could not be judged"));
            assert_eq!(budget.json()["p99_ms"], Value::Null);
        }
    }
}
