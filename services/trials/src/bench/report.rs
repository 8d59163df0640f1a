//! Report of a benchmark as text, as JSON, and as a record in a Markdown file.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use exports::report::run::Limit;
use failure::Failure;
use failure::wording::Table;
use serde_json::{Value, json};

use super::provenance::Provenance;

/// Report of a benchmark.
#[derive(Debug)]
pub struct Report {
    /// The name of the benchmark.
    pub(super) bench: &'static str,
    /// The title of the table.
    pub(super) title: String,
    /// The provenance of the measurements.
    pub(super) provenance: Provenance,
    /// Settings by name.
    pub(super) settings: Value,
    /// Table of the numbers.
    pub(super) table: Table,
    /// Lines below the table.
    pub(super) notes: Vec<String>,
    /// Limits, with the measured values.
    pub(super) limits: Vec<Limit>,
    /// The measurements as JSON.
    pub(super) numbers: Value,
}

impl Report {
    /// Returns true if all limits were met.
    pub fn is_held(&self) -> bool {
        self.limits.iter().all(|limit| limit.held)
    }

    /// Appends the report to a Markdown file. Creates the file and its folder if they do not exist.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be written to.
    pub fn append(&self, file: &Path) -> Result<(), Failure> {
        let written = self.write_record(file);
        written.map_err(|error| failure::in_file(file, &error))
    }

    fn write_record(&self, file: &Path) -> std::io::Result<()> {
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let text = format!(
            "\n## {}: {}\n\n```\n{}\n```\n",
            self.provenance.date,
            self.bench,
            self.text()
        );
        let mut record = OpenOptions::new().create(true).append(true).open(file)?;
        // The text is written with a single call, so that records of concurrent benchmarks do not mix.
        record.write_all(text.as_bytes())
    }

    /// Returns the report as JSON.
    pub fn json(&self) -> Value {
        let limits = self.limits.iter().map(
            |limit| json!({ "what": limit.what, "asked": limit.asked, "got": limit.got, "held": limit.held }),
        );
        json!({
            "schema_version": 1,
            "bench": self.bench,
            "occasion": self.provenance,
            "settings": self.settings,
            "numbers": self.numbers,
            "limits": limits.collect::<Vec<_>>(),
            "held": self.is_held(),
        })
    }

    /// Returns the report as text.
    pub fn text(&self) -> String {
        let mut lines = vec![self.title.clone()];
        lines.extend(self.provenance.text().lines().map(str::to_owned));
        lines.push(settings(&self.settings));
        lines.push(String::new());
        lines.extend(self.table.lines());
        lines.extend(self.notes.iter().cloned());
        for it in &self.limits {
            let word = if it.held { "held  " } else { "MISSED" };
            lines.push(format!(
                "{word} {:<44} {:>12}   {}",
                it.what, it.asked, it.got
            ));
        }
        lines.join("\n")
    }
}

/// Returns the settings in one line: `name value, name value`.
fn settings(value: &Value) -> String {
    let entries = value.as_object().into_iter().flatten();
    let texts = entries.map(|(name, value)| match value {
        Value::String(text) if text.is_empty() => format!("{name} none"),
        Value::String(text) => format!("{name} {text}"),
        other => format!("{name} {other}"),
    });
    texts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::limit;

    fn report(got: f64) -> Report {
        let mut table = Table::new(["<who", "p50", "max"]);
        table.row(["somebody", "1.5", "10.25"].map(str::to_owned));
        Report {
            bench: "transport",
            title: "one hop".to_owned(),
            provenance: Provenance::now(),
            settings: json!({ "messages": 7, "cores": "" }),
            table,
            notes: vec!["a note".to_owned()],
            limits: vec![limit::at_most("p50, us", 2.0, Some(got))],
            numbers: json!([1.5]),
        }
    }

    #[test]
    fn columns_are_aligned_with_their_headers() {
        let text = report(1.5).text();
        assert!(text.contains("\nwho       p50    max\n"), "{text}");
        assert!(text.contains("\nsomebody  1.5  10.25\na note\n"), "{text}");
        assert!(text.contains("\ncores none, messages 7\n"), "{text}");
    }

    #[test]
    fn a_missed_limit_is_shown_and_the_report_counts_as_failed() {
        for (got, held, word) in [(1.5, true, "held  "), (2.5, false, "MISSED")] {
            let report = report(got);
            assert_eq!(report.is_held(), held);
            assert_eq!(report.json()["held"], held);
            assert!(report.text().contains(&format!("{word} p50, us")));
        }
    }

    #[test]
    fn records_are_appended() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("new/record.md");
        for _ in 0..2 {
            report(1.0).append(&file).unwrap();
        }
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(text.matches("\n## ").count(), 2);
        assert_eq!(text.matches("commit ").count(), 2);
        assert_eq!(text.matches("messages 7").count(), 2);
        assert_eq!(text.matches("```").count(), 4);
    }
}
