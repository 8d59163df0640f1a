//! Whether a run was as fast as it was asked to be.

use core::fmt::Write as _;

use serde_json::{Value, json};

/// The longest time from capture to result that 99 of 100 frames may take, and what they took.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Budget {
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
    /// * `latency`: as the recorder wrote it; null if it did not.
    pub(crate) fn new(limit_ms: f64, latency: &Value) -> Self {
        let end_to_end = &latency["end_to_end"];
        let n_frames = end_to_end["count"].as_u64().unwrap_or(0);
        Self {
            limit_ms,
            n_frames,
            p99_ms: end_to_end["p99_ms"].as_f64().filter(|_| n_frames > 0),
            table: table(latency),
        }
    }

    /// Whether frames were measured, and were fast enough.
    pub(crate) fn is_held(&self) -> bool {
        self.p99_ms.is_some_and(|it| it <= self.limit_ms)
    }

    /// Whether frames were measured, and were too slow.
    pub(crate) fn is_exceeded(&self) -> bool {
        self.p99_ms.is_some() && !self.is_held()
    }

    /// In one line.
    pub(crate) fn verdict(&self) -> String {
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
    pub(crate) fn complaint(&self) -> String {
        let text = format!("latency budget of {}", self.verdict());
        if self.table.is_empty() {
            text
        } else {
            format!("{text}\n{}", self.table.trim_end())
        }
    }

    /// For programs.
    pub(crate) fn json(&self) -> Value {
        json!({
            "budget_ms": self.limit_ms,
            "p99_ms": self.p99_ms,
            "frames": self.n_frames,
            "held": self.is_held(),
        })
    }
}

/// Percentiles of every stage and of the whole, with a title; empty where nothing was measured.
///
/// * `latency`: as the recorder wrote it.
pub(crate) fn table(latency: &Value) -> String {
    let rows = ["capture", "pose", "quality", "fuse", "triangulate"];
    let stages = rows.map(|it| (it, &latency["stages"][it]));
    let whole = ("end to end", &latency["end_to_end"]);
    let keys = ["p50_ms", "p99_ms", "p99_9_ms", "max_ms"];
    let mut text = String::new();
    for (name, it) in stages.into_iter().chain([whole]) {
        if it["count"].as_u64().unwrap_or(0) == 0 {
            continue;
        }
        if text.is_empty() {
            let titles = ["p50", "p99", "p99.9", "max"];
            row(&mut text, "  latency, ms", titles.map(str::to_owned));
        }
        let cells = keys.map(|key| {
            it[key]
                .as_f64()
                .map_or("-".to_owned(), |it| format!("{it:.1}"))
        });
        row(&mut text, &format!("    {name}"), cells);
    }
    text
}

fn row(text: &mut String, name: &str, cells: [String; 4]) {
    let [p50, p99, p99_9, max] = cells;
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "{name:<15} {p50:>9} {p99:>9} {p99_9:>9} {max:>9}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn latency(count: u64) -> Value {
        let it = json!({
            "count": count, "p50_ms": 20.0, "p99_ms": 50.0, "p99_9_ms": 60.04, "max_ms": 123.0,
        });
        json!({ "stages": { "pose": it }, "end_to_end": it })
    }

    #[test]
    fn a_run_as_slow_as_it_may_be_holds_its_budget() {
        let budget = Budget::new(50.0, &latency(100));
        assert!(budget.is_held() && !budget.is_exceeded());
        assert_eq!(
            budget.verdict(),
            "50 ms held: p99 end to end is 50.0 ms of 100 frames"
        );
    }

    #[test]
    fn a_slower_one_misses_it_and_says_where_the_time_went() {
        let budget = Budget::new(49.9, &latency(100));
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
        for latency in [Value::Null, json!({}), latency(0)] {
            let budget = Budget::new(1e9, &latency);
            assert!(!budget.is_held() && !budget.is_exceeded(), "{latency}");
            assert!(budget.complaint().contains("could not be judged"));
            assert_eq!(budget.json()["p99_ms"], Value::Null);
        }
    }
}
