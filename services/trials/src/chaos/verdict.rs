//! Verdict on a scenario, as text and as JSON.

use core::fmt::Write as _;

use exports::report::run::Limit;
use serde_json::{Value, json};

use super::judge::{RandomKillsOutcome, SupervisorKillOutcome};
use crate::trial::cost::Cost;

/// Verdict on a scenario.
#[derive(Debug)]
pub(super) struct Verdict {
    /// Name of the scenario.
    pub scenario: String,
    /// The measurements as text.
    pub measured: String,
    /// Further lines of text.
    pub details: Vec<String>,
    /// The measurements as JSON.
    pub numbers: Value,
    /// Limits, with the measured values.
    pub limits: Vec<Limit>,
    /// The report on the run as JSON.
    pub run: Value,
}

impl Verdict {
    /// Returns true if all limits were met.
    pub(super) fn is_held(&self) -> bool {
        self.limits.iter().all(|limit| limit.held)
    }

    /// Returns the verdict as JSON.
    pub(super) fn json(&self) -> Value {
        let limit = |limit: &Limit| json!({ "what": limit.what, "asked": limit.asked, "measured": limit.got, "held": limit.held });
        json!({
            "scenario": self.scenario,
            "held": self.is_held(),
            "limits": self.limits.iter().map(limit).collect::<Vec<_>>(),
            "measured": self.numbers,
            "run": self.run,
        })
    }
}

/// Returns the verdicts as a table, with the missed limits of each scenario.
pub(super) fn table(verdicts: &[Verdict]) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _infallible = write(&mut text, verdicts);
    text.trim_end().to_owned()
}

fn write(text: &mut String, verdicts: &[Verdict]) -> core::fmt::Result {
    writeln!(text, "{:<8}{:<17} measured", "", "scenario")?;
    for verdict in verdicts {
        let word = if verdict.is_held() { "held" } else { "MISSED" };
        writeln!(
            text,
            "{word:<8}{:<17} {}",
            verdict.scenario, verdict.measured
        )?;
        for limit in verdict.limits.iter().filter(|limit| !limit.held) {
            let Limit {
                what, asked, got, ..
            } = limit;
            writeln!(
                text,
                "{:<8}{:<17}   {what}: {got} (required: {asked})",
                "", ""
            )?;
        }
        for line in &verdict.details {
            writeln!(text, "{:<8}{line}", "")?;
        }
    }
    let n_held = verdicts.iter().filter(|verdict| verdict.is_held()).count();
    writeln!(text, "{n_held} of {} scenarios held", verdicts.len())
}

/// Describes the measurements of a process fault.
pub(super) fn of_cost(process: &str, cost: &Cost, n_results: usize) -> String {
    format!(
        "{process}: noticed: {}, restarted: {}, back: {}; longest pause: {} (before the fault: {}); {n_results} results",
        ms(cost.noticed_ms),
        ms(cost.restarted_ms),
        ms(cost.back_ms),
        ms(cost.longest_pause_ms),
        ms(cost.usual_pause_ms),
    )
}

/// Describes the measurements of random kills.
pub(super) fn of_random_kills(measured: &RandomKillsOutcome, n_results: usize) -> String {
    let mut text = format!(
        "{} kills; back: p50 {}, p99 {}; {n_results} results",
        measured.n_kills,
        ms(measured.downtime_ms.map(|downtime_ms| downtime_ms.p50)),
        ms(measured.downtime_ms.map(|downtime_ms| downtime_ms.p99)),
    );
    if let Some([first, last]) = &measured.resources {
        let mb = |bytes: u64| bytes as f64 / 1e6;
        // Writing to a string cannot fail.
        let _infallible = write!(
            text,
            "; at the start and at the end {:.0} and {:.0} MB, {} and {} descriptors, {} and {} files",
            mb(first.memory_bytes + first.supervisor_memory_bytes),
            mb(last.memory_bytes + last.supervisor_memory_bytes),
            first.descriptors,
            last.descriptors,
            first.files,
            last.files,
        );
    }
    text
}

/// Describes the measurements of a killed supervisor.
pub(super) fn of_orphans(killed: &SupervisorKillOutcome, n_results: usize) -> String {
    format!(
        "processes ended: {}; {} files left for the next run; first result of the next run: {}; {n_results} results",
        ms(killed.ended_ms),
        killed.files,
        ms(killed.result_ms),
    )
}

/// Formats a time in milliseconds; `never` for `None`.
pub(super) fn ms(time: Option<f64>) -> String {
    time.map_or_else(|| "never".to_owned(), |ms| format!("{ms:.0} ms"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::limit::at_most;

    #[test]
    fn missed_limits_are_listed_below_their_scenario() {
        let verdict = |scenario: &str, got| Verdict {
            scenario: scenario.to_owned(),
            measured: "pose-1: noticed 3 ms".to_owned(),
            details: vec!["from s".to_owned()],
            numbers: Value::Null,
            limits: vec![
                at_most("time until back, ms", 8000.0, got),
                at_most("x", 1.0, Some(0.0)),
            ],
            run: Value::Null,
        };
        let verdicts = [verdict("kill-pose", Some(7.0)), verdict("hang-pose", None)];
        let text = table(&verdicts);
        let lines: Vec<&str> = text.lines().skip(1).map(str::trim).collect();
        let expected = [
            "held    kill-pose         pose-1: noticed 3 ms",
            "from s",
            "MISSED  hang-pose         pose-1: noticed 3 ms",
            "time until back, ms: nothing (required: at most 8000)",
            "from s",
            "1 of 2 scenarios held",
        ];
        assert_eq!(lines, expected);
        assert_eq!(verdicts[0].json()["held"], json!(true));
        assert_eq!(verdicts[1].json()["limits"][0]["held"], json!(false));
    }

    #[test]
    fn a_time_without_measurement_is_shown_as_never() {
        let cost = Cost {
            noticed_ms: Some(3.4),
            ..Cost::default()
        };
        let text = of_cost("pose-1", &cost, 7);
        assert!(text.contains("noticed: 3 ms, restarted: never"), "{text}");
    }
}
