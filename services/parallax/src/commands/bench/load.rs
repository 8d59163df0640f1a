//! `parallax bench latency|throughput|scale`: whole deployments under load.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use launch::output;
use messages::MAX_VIEWS;
use report::run::Limit;
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use serde_json::{Value, json};

use super::course::{Case, Course, Measured};
use super::occasion::Occasion;
use super::report::Report;
use super::{EXITS, Output};
use crate::globals::Globals;
use crate::spread::Spread;
use crate::trial::limit;

const HELP: &str = "\
Every run is a deployment of real processes, as `parallax run` starts it. Without a deployment file its cameras show a \
person who does not exist, 320x240 pixels, `--rate` frames a second; the pictures are made beforehand, into OUT/pictures \
(with --live by the camera processes while they run, which then compete with the others for the cores). They are \
searched near the last pose, as the demo's are (`--set pose.search=full`: everywhere).

latency     --views cameras that keep up with the clock; then the same while the process of the last camera is dead
throughput  --views cameras, every frame, as fast as they are taken
scale       as latency with 1, 2, ... --views cameras; then with all of them, the last one dead

The table says for every run how many results there were and how many a second, how long they took from the capture of \
the first picture to the sending of the result (end to end) and in every stage, milliseconds, and how much processor \
time a result took, all processes together. A dead camera is killed at the first result and not started again; what \
is measured then begins with its death.

The numbers of a run are in its folder, OUT/<run>, as any run leaves them.";

/// What to measure.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// The deployment file; cameras that do not exist if not given.
    pub(super) deployment: Option<PathBuf>,
    /// Cameras; of a deployment file the first so many, all if not given. 4 of those that do not exist.
    #[arg(long, value_name = "N", value_parser = views)]
    pub(super) views: Option<usize>,
    /// Footage of every run, seconds.
    #[arg(long, value_name = "S", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=36_000))]
    pub(super) seconds: u32,
    /// Frames a second of cameras that do not exist.
    #[arg(long, value_name = "HZ", default_value_t = 5.0, value_parser = crate::commands::synth::rate)]
    pub(super) rate: f64,
    /// Seed of the performance, the room and the lamps.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Let camera processes make their pictures while they run.
    #[arg(long, conflicts_with = "deployment")]
    pub(super) live: bool,
    /// Let stages look for messages without pause: `--set runtime.spin=true`.
    #[arg(long)]
    pub(super) spin: bool,
    /// Replace a value of the deployment, for example `--set fuse.workers=2`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Folder for pictures and results.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(super) out: PathBuf,
    /// Name of the deployment: two that run at once need two.
    #[arg(long, value_name = "NAME", default_value = "bench")]
    pub(super) name: String,
    /// Largest median end to end, milliseconds, of the run with all cameras.
    #[arg(long, value_name = "MS")]
    max_p50_ms: Option<f64>,
    /// Largest 99th percentile, likewise.
    #[arg(long, value_name = "MS")]
    max_p99_ms: Option<f64>,
    /// Least results a second, likewise.
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// Where numbers go.
    #[command(flatten)]
    output: Output,
}

/// A number of cameras, for the command line.
fn views(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|it| (1..=MAX_VIEWS).contains(it));
    n.ok_or_else(|| format!("expected 1 to {MAX_VIEWS}"))
}

/// Which runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// All cameras at the pace of the clock; one dead.
    Latency,
    /// All cameras, every frame.
    Throughput,
    /// One camera more from run to run; one dead.
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
            Self::Latency => "from capture to result at the pace of the clock, milliseconds",
            Self::Throughput => "every frame as fast as it is taken, milliseconds",
            Self::Scale => "one camera more from run to run, milliseconds",
        }
    }

    /// The runs with so many cameras.
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

/// Measures.
pub(super) fn run(
    kind: Kind,
    arguments: &Arguments,
    globals: Globals,
) -> Result<ExitCode, Failure> {
    let occasion = Occasion::now();
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let stopped = || {
        output::message("stopped: nothing is reported");
        Ok(ExitCode::from(ExitKind::Interrupted.status()))
    };
    let Some(course) = Course::new(arguments, globals, &stop)? else {
        return stopped();
    };
    let cases = kind.cases(course.n_views());
    let mut all = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        if !globals.quiet {
            let (nth, of, seconds) = (index + 1, cases.len(), arguments.seconds);
            output::message(format_args!(
                "run {nth} of {of}: {case}, {seconds} s of footage"
            ));
        }
        match course.measure(*case, &stop)? {
            Some(measured) => all.push(measured),
            None => return stopped(),
        }
    }
    let report = Report {
        bench: kind.name(),
        title: kind.title().to_owned(),
        occasion,
        settings: arguments.settings(course.n_views()),
        table: table(&all),
        notes: Vec::new(),
        limits: arguments.limits(&all),
        numbers: all.iter().map(Measured::json).collect(),
    };
    report.publish(&arguments.output, globals)
}

impl Arguments {
    fn settings(&self, n_views: usize) -> Value {
        let file = self.deployment.as_ref();
        let pictures = match file {
            Some(file) => file.display().to_string(),
            None if self.live => format!("made while it runs, seed {}", self.seed),
            None => format!("made beforehand, seed {}", self.seed),
        };
        json!({
            "views": n_views,
            "seconds": self.seconds,
            "rate_hz": file.is_none().then_some(self.rate),
            "pictures": pictures,
            "spin": self.spin,
            "set": self.set.join(" "),
        })
    }

    /// What was asked of the run with all cameras, none of them dead.
    fn limits(&self, all: &[Measured]) -> Vec<Limit> {
        let whole = all.iter().rfind(|it| !it.case.has_dead);
        let end_to_end = whole.and_then(|it| it.end_to_end);
        let rate = whole.and_then(|it| it.rate_hz);
        let limits = [
            self.max_p50_ms
                .map(|it| limit::at_most("p50, ms", it, end_to_end.map(|it| it.p50))),
            self.max_p99_ms
                .map(|it| limit::at_most("p99, ms", it, end_to_end.map(|it| it.p99))),
            self.min_rate
                .map(|it| limit::at_least("results a second", it, rate)),
        ];
        limits.into_iter().flatten().collect()
    }
}

/// A row for every run, and below it one for every stage.
fn table(all: &[Measured]) -> Vec<Vec<String>> {
    let heads = [
        "run", "results", "a second", "p50", "p99", "p99.9", "max", "cpu", "dropped",
    ];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    for it in all {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |it| format!("{it:.1}"));
        let mut row = vec![
            it.case.to_string(),
            it.n_results.to_string(),
            number(it.rate_hz),
        ];
        row.extend(Spread::cells(it.end_to_end, 1));
        row.extend([number(it.cpu_ms_per_result()), it.n_dropped.to_string()]);
        rows.push(row);
        for (stage, spread) in &it.stages {
            let mut row = vec![format!("  {stage}"), String::new(), String::new()];
            row.extend(Spread::cells(Some(*spread), 1));
            rows.push(row);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(kind: Kind, n_views: usize) -> Vec<String> {
        let cases = kind.cases(n_views);
        cases.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_camera_dies_after_all_runs_in_which_none_does() {
        assert_eq!(
            names(Kind::Scale, 3),
            ["1 view", "2 views", "3 views", "3 views, one dead"]
        );
        assert_eq!(names(Kind::Latency, 2), ["2 views", "2 views, one dead"]);
        assert_eq!(names(Kind::Throughput, 4), ["4 views, every frame"]);
    }

    #[test]
    fn the_only_camera_does_not_die() {
        assert_eq!(names(Kind::Latency, 1), ["1 view"]);
    }

    #[test]
    fn a_number_of_cameras_is_one_that_a_deployment_may_have() {
        assert_eq!(views("16"), Ok(16));
        for wrong in ["0", "17", "-1", "four"] {
            views(wrong).unwrap_err();
        }
    }
}
