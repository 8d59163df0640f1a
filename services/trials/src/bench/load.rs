//! Benchmarks of whole deployments under load.

use exports::report::run::Limit;
use failure::wording::Table;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use serde_json::{Value, json};
use terminal::output::{self, Verbosity};

use super::options::Options;
use super::provenance::Provenance;
use super::report::Report;
use super::workload::{Case, Measured, Workload};
use crate::spread::Spread;
use crate::trial::limit;

/// Kind of load benchmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A run with all cameras in real time, then the same run with one camera killed.
    Latency,
    /// A run with all cameras, in which every frame is processed as fast as possible.
    Throughput,
    /// Runs in real time with one camera, two cameras, and so on; then a run with all cameras, one of which is killed.
    Scale,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Latency => "latency",
            Self::Throughput => "throughput",
            Self::Scale => "scale",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Latency => "from capture to result in real time, milliseconds",
            Self::Throughput => "every frame, as fast as possible, milliseconds",
            Self::Scale => "one more camera in each run, milliseconds",
        }
    }

    /// Returns the runs of a benchmark with at most `n_views` cameras.
    fn cases(self, n_views: usize) -> Vec<Case> {
        let case = |n_views| Case {
            n_views,
            is_lossless: self == Self::Throughput,
            has_dead: false,
        };
        let mut cases = match self {
            Self::Latency | Self::Throughput => vec![case(n_views)],
            Self::Scale => (1..=n_views).map(case).collect(),
        };
        if self != Self::Throughput && n_views > 1 {
            cases.push(Case {
                has_dead: true,
                ..case(n_views)
            });
        }
        cases
    }
}

/// Measures a deployment under load. Returns `None` if the benchmark was interrupted.
///
/// # Errors
///
/// Fails if the deployment cannot be read or used, if it has fewer cameras than requested, or if a run fails.
pub fn load(
    kind: Kind,
    options: &Options,
    verbosity: Verbosity,
) -> Result<Option<Report>, Failure> {
    let provenance = Provenance::now();
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let Some(workload) = Workload::new(options, verbosity, &stop)? else {
        return Ok(None);
    };
    let cases = kind.cases(workload.n_views());
    let mut all = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        if !verbosity.quiet {
            let (nth, of, seconds) = (index + 1, cases.len(), options.seconds);
            output::message(format_args!(
                "run {nth} of {of}: {case}, {seconds} s of footage"
            ));
        }
        match workload.measure(*case, &stop)? {
            Some(measured) => all.push(measured),
            None => return Ok(None),
        }
    }
    Ok(Some(Report {
        bench: kind.name(),
        title: kind.title().to_owned(),
        provenance,
        settings: options.settings(workload.n_views()),
        table: table(&all),
        notes: Vec::new(),
        limits: options.limits(&all),
        numbers: all.iter().map(Measured::json).collect(),
    }))
}

impl Options {
    fn settings(&self, n_views: usize) -> Value {
        let file = self.deployment.as_ref();
        let pictures = match file {
            Some(file) => file.display().to_string(),
            None if self.live => format!("rendered during the run, seed {}", self.seed),
            None => format!("rendered in advance, seed {}", self.seed),
        };
        json!({
            "views": n_views,
            "seconds": self.seconds,
            "rate_hz": file.is_none().then_some(self.rate_hz),
            "pictures": pictures,
            "spin": self.spin,
            "set": self.set.join(" "),
        })
    }

    /// Returns the requested limits, checked on the run with all cameras.
    fn limits(&self, all: &[Measured]) -> Vec<Limit> {
        let whole = all.iter().rfind(|measured| !measured.case.has_dead);
        let end_to_end = whole.and_then(|whole| whole.end_to_end);
        let rate = whole.and_then(|whole| whole.rate_hz);
        let limits = [
            self.max_p50_ms.map(|max_p50_ms| {
                limit::at_most(
                    "p50, ms",
                    max_p50_ms,
                    end_to_end.map(|end_to_end| end_to_end.p50),
                )
            }),
            self.max_p99_ms.map(|max_p99_ms| {
                limit::at_most(
                    "p99, ms",
                    max_p99_ms,
                    end_to_end.map(|end_to_end| end_to_end.p99),
                )
            }),
            self.min_rate_hz
                .map(|min_rate_hz| limit::at_least("results per second", min_rate_hz, rate)),
        ];
        limits.into_iter().flatten().collect()
    }
}

/// Returns the table, with a row for each run and a row for each stage of a run.
fn table(all: &[Measured]) -> Table {
    let mut table = Table::new([
        "<run",
        "results",
        "per second",
        "p50",
        "p99",
        "p99.9",
        "max",
        "cpu",
        "dropped",
    ]);
    for measured in all {
        let number =
            |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
        let mut row = vec![
            measured.case.to_string(),
            measured.n_results.to_string(),
            number(measured.rate_hz),
        ];
        row.extend(Spread::cells(measured.end_to_end, 1));
        row.extend([
            number(measured.cpu_ms_per_result()),
            measured.n_dropped.to_string(),
        ]);
        table.row(row);
        for (stage, spread) in &measured.stages {
            let mut row = vec![format!("  {stage}"), String::new(), String::new()];
            row.extend(Spread::cells(Some(*spread), 1));
            table.row(row);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(kind: Kind, n_views: usize) -> Vec<String> {
        let cases = kind.cases(n_views);
        cases.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn the_run_with_a_killed_camera_comes_last() {
        assert_eq!(
            names(Kind::Scale, 3),
            ["1 view", "2 views", "3 views", "3 views, one camera killed"]
        );
        assert_eq!(
            names(Kind::Latency, 2),
            ["2 views", "2 views, one camera killed"]
        );
        assert_eq!(names(Kind::Throughput, 4), ["4 views, every frame"]);
    }

    #[test]
    fn a_deployment_with_a_single_camera_has_no_run_with_a_killed_camera() {
        assert_eq!(names(Kind::Latency, 1), ["1 view"]);
    }
}
