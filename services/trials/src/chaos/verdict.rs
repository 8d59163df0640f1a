//! What held in one scenario, as text and as JSON.

use core::fmt::Write as _;

use report::run::Limit;
use serde_json::{Value, json};

use super::judge::{Barraged, Orphaned};
use crate::trial::cost::Cost;

/// What held in one scenario.
#[derive(Debug)]
pub(super) struct Verdict {
    /// Its name.
    pub scenario: String,
    /// What was measured, for people.
    pub measured: String,
    /// What else is to be read below it, line by line.
    pub more: Vec<String>,
    /// The same for programs.
    pub numbers: Value,
    /// The verdicts.
    pub limits: Vec<Limit>,
    /// What became of the run, for programs.
    pub run: Value,
}

impl Verdict {
    /// Whether no limit was missed.
    pub(super) fn is_held(&self) -> bool {
        self.limits.iter().all(|it| it.held)
    }

    /// For programs.
    pub(super) fn json(&self) -> Value {
        let limit = |it: &Limit| json!({ "what": it.what, "asked": it.asked, "measured": it.got, "held": it.held });
        json!({
            "scenario": self.scenario,
            "held": self.is_held(),
            "limits": self.limits.iter().map(limit).collect::<Vec<_>>(),
            "measured": self.numbers,
            "run": self.run,
        })
    }
}

/// A table of scenarios, and below each what did not hold.
pub(super) fn table(verdicts: &[Verdict]) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _infallible = write(&mut text, verdicts);
    text.trim_end().to_owned()
}

fn write(text: &mut String, verdicts: &[Verdict]) -> core::fmt::Result {
    writeln!(text, "{:<8}{:<17} measured", "", "scenario")?;
    for it in verdicts {
        let word = if it.is_held() { "held" } else { "MISSED" };
        writeln!(text, "{word:<8}{:<17} {}", it.scenario, it.measured)?;
        for limit in it.limits.iter().filter(|it| !it.held) {
            let Limit {
                what, asked, got, ..
            } = limit;
            writeln!(text, "{:<8}{:<17}   {what}: {got} (asked: {asked})", "", "")?;
        }
        for line in &it.more {
            writeln!(text, "{:<8}{line}", "")?;
        }
    }
    let n_held = verdicts.iter().filter(|it| it.is_held()).count();
    writeln!(text, "{n_held} of {} scenarios held", verdicts.len())
}

/// What a process cost that was struck once.
pub(super) fn of_cost(process: &str, cost: &Cost, n_results: usize) -> String {
    format!(
        "{process}: noticed {}, restarted {}, back {}; longest pause {} (before {}); {n_results} results",
        ms(cost.noticed_ms),
        ms(cost.restarted_ms),
        ms(cost.back_ms),
        ms(cost.longest_pause_ms),
        ms(cost.usual_pause_ms),
    )
}

/// What a barrage cost.
pub(super) fn of_barrage(it: &Barraged, n_results: usize) -> String {
    let mut text = format!(
        "{} kills; back p50 {}, p99 {}; {n_results} results",
        it.n_kills,
        ms(it.away_ms.map(|it| it.p50)),
        ms(it.away_ms.map(|it| it.p99)),
    );
    if let Some([first, last]) = &it.held {
        let mb = |bytes: u64| bytes as f64 / 1e6;
        // Writing to a string cannot fail.
        let _infallible = write!(
            text,
            "; at first and at last {:.0} and {:.0} MB, {} and {} descriptors, {} and {} files",
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

/// What the death of a supervisor cost.
pub(super) fn of_orphans(it: &Orphaned, n_results: usize) -> String {
    format!(
        "its processes ended {}; {} files left for the next start, whose first result came {}; {n_results} results",
        ms(it.ended_ms),
        it.files,
        ms(it.result_ms),
    )
}

/// Milliseconds in words.
pub(super) fn ms(it: Option<f64>) -> String {
    it.map_or_else(|| "never".to_owned(), |it| format!("{it:.0} ms"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::limit::at_most;

    #[test]
    fn what_did_not_hold_is_named_below_its_scenario() {
        let verdict = |scenario: &str, got| Verdict {
            scenario: scenario.to_owned(),
            measured: "pose-1: noticed 3 ms".to_owned(),
            more: vec!["from s".to_owned()],
            numbers: Value::Null,
            limits: vec![
                at_most("back after, ms", 8000.0, got),
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
            "back after, ms: nothing (asked: at most 8000)",
            "from s",
            "1 of 2 scenarios held",
        ];
        assert_eq!(lines, expected);
        assert_eq!(verdicts[0].json()["held"], json!(true));
        assert_eq!(verdicts[1].json()["limits"][0]["held"], json!(false));
    }

    #[test]
    fn what_never_happened_is_called_so() {
        let cost = Cost {
            noticed_ms: Some(3.4),
            ..Cost::default()
        };
        let text = of_cost("pose-1", &cost, 7);
        assert!(text.contains("noticed 3 ms, restarted never"), "{text}");
    }
}
