//! The latency budget of a run: a limit on the 99th percentile of the time from capture to result.

use core::fmt::Write as _;

use runfiles::{LatencyReport, Percentiles};
use serde_json::{Value, json};

/// A latency budget and the measured latency.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// The budget, in milliseconds.
    limit_ms: f64,
    /// Number of measured frames.
    n_frames: u64,
    /// The measured 99th percentile, in milliseconds; `None` if no frame was measured.
    p99_ms: Option<f64>,
    /// The latency table of all stages, as text; empty if nothing was measured.
    table: String,
}

impl Budget {
    /// Compares the latency of a run with its budget.
    ///
    /// * `limit_ms`: the budget, in milliseconds.
    /// * `latency`: the latency report of the run, if there is one.
    pub fn new(limit_ms: f64, latency: Option<&LatencyReport>) -> Self {
        let measured = latency.map(|latency| latency.end_to_end);
        let measured = measured.filter(|measured| measured.count > 0);
        Self {
            limit_ms,
            n_frames: measured.map_or(0, |measured| measured.count),
            p99_ms: measured.map(|measured| measured.p99_ms),
            table: latency.map_or_else(String::new, table),
        }
    }

    /// Returns true if frames were measured and the budget was met.
    pub fn is_held(&self) -> bool {
        self.p99_ms.is_some_and(|p99_ms| p99_ms <= self.limit_ms)
    }

    /// Returns true if frames were measured and the budget was exceeded.
    pub fn is_exceeded(&self) -> bool {
        self.p99_ms.is_some() && !self.is_held()
    }

    /// Returns the verdict in one line.
    pub fn verdict(&self) -> String {
        let Self {
            limit_ms, n_frames, ..
        } = self;
        match self.p99_ms {
            None => format!("{limit_ms} ms could not be checked: no frame has an end-to-end time"),
            Some(p99) if self.is_held() => {
                format!(
                    "{limit_ms} ms met: the 99th percentile end to end is {p99:.1} ms ({n_frames} frames)"
                )
            }
            Some(p99) => {
                format!(
                    "{limit_ms} ms exceeded: the 99th percentile end to end is {p99:.1} ms ({n_frames} frames)"
                )
            }
        }
    }

    /// Returns the verdict and the latency table, as the error message of a run that exceeds its budget.
    pub fn error_text(&self) -> String {
        let text = format!("latency budget of {}", self.verdict());
        if self.table.is_empty() {
            text
        } else {
            format!("{text}\n{}", self.table.trim_end())
        }
    }

    /// Returns the verdict as JSON.
    pub fn json(&self) -> Value {
        json!({
            "budget_ms": self.limit_ms,
            "p99_ms": self.p99_ms,
            "frames": self.n_frames,
            "held": self.is_held(),
        })
    }
}

/// Returns the latency table, in milliseconds: a header, a row per stage, and a row for the end-to-end time. Empty if nothing was measured.
pub fn table(latency: &LatencyReport) -> String {
    let mut text = String::new();
    for (name, percentiles) in rows(latency).filter(|(_, percentiles)| percentiles.count > 0) {
        if text.is_empty() {
            let titles = ["p50", "p99", "p99.9", "max"];
            row(&mut text, "  latency, ms", titles.map(str::to_owned));
        }
        let times = [
            percentiles.p50_ms,
            percentiles.p99_ms,
            percentiles.p99_9_ms,
            percentiles.max_ms,
        ];
        let cells = times.map(|ms| format!("{ms:.1}"));
        row(&mut text, &format!("    {name}"), cells);
    }
    text
}

/// Returns the latency percentiles of the measured stages, in pipeline order, then the percentiles of the end-to-end time.
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
    fn a_latency_equal_to_the_budget_meets_the_budget() {
        let budget = Budget::new(50.0, Some(&latency(100)));
        assert!(budget.is_held() && !budget.is_exceeded());
        assert_eq!(
            budget.verdict(),
            "50 ms met: the 99th percentile end to end is 50.0 ms (100 frames)"
        );
    }

    #[test]
    fn an_exceeded_budget_is_reported_with_the_latency_table() {
        let budget = Budget::new(49.9, Some(&latency(100)));
        assert!(budget.is_exceeded());
        let expected = "\
latency budget of 49.9 ms exceeded: the 99th percentile end to end is 50.0 ms (100 frames)
  latency, ms         p50       p99     p99.9       max
    pose             20.0      50.0      60.0     123.0
    end to end       20.0      50.0      60.0     123.0";
        assert_eq!(budget.error_text(), expected);
        assert_eq!(budget.json()["held"], false);
    }

    #[test]
    fn a_budget_without_measurement_is_neither_met_nor_exceeded() {
        for latency in [None, Some(LatencyReport::default()), Some(latency(0))] {
            let budget = Budget::new(1e9, latency.as_ref());
            assert!(!budget.is_held() && !budget.is_exceeded(), "{latency:?}");
            assert!(budget.error_text().contains("could not be checked"));
            assert_eq!(budget.json()["p99_ms"], Value::Null);
        }
    }
}
