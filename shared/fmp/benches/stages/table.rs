//! The table of results.

use std::fmt;
use std::fs;
use std::path::Path;

use kernels::Isa;
use serde::Serialize;

use crate::floor::{Floors, Peaks};
use crate::options::Options;
use crate::readable::Readable;
use crate::stages::{Stage, Times};
use crate::workload::Workload;

/// Times per frame of other programs with the HumanEva model on two threads: image, program, and time in milliseconds.
const PEERS: [(&str, &str, f64); 3] = [
    ("172x224", "authors", 1120.0),
    ("172x224", "PartsBasedDetector", 389.0),
    ("640x480", "authors", 6530.0),
];

/// One measurement.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    image: String,
    filter: usize,
    stage: &'static str,
    isa: &'static str,
    threads: usize,
    min_ms: f64,
    median_ms: f64,
    cpu_ms: f64,
    floor_ms: Option<f64>,
    percent_of_floor: Option<f64>,
    times_readable: Option<f64>,
    times_authors: Option<f64>,
    times_parts_based_detector: Option<f64>,
    #[serde(skip)]
    kind: Stage,
}

impl Row {
    pub(crate) fn new(
        workload: &Workload,
        (kind, isa, threads): (Stage, Isa, usize),
        times: Times,
    ) -> Self {
        let image = workload.image_name();
        let peer = |name: &str| {
            let comparable = kind == Stage::Frame && workload.filter == 6;
            let peer = PEERS.iter().find(|peer| peer.0 == image && peer.1 == name);
            peer.filter(|_| comparable).map(|peer| peer.2 / times.min)
        };
        Self {
            filter: workload.filter,
            stage: kind.name(),
            isa: isa.name(),
            threads,
            min_ms: times.min,
            median_ms: times.median,
            cpu_ms: times.cpu,
            floor_ms: None,
            percent_of_floor: None,
            times_readable: None,
            times_authors: peer("authors"),
            times_parts_based_detector: peer("PartsBasedDetector"),
            image,
            kind,
        }
    }

    pub(crate) fn compared(self, floors: &Floors, readable: &Readable) -> Self {
        let floor_ms = floors.ms.of(self.kind).map(|value| value / self.threads as f64);
        // The reference implementation does not support terms of other views.
        let readable = readable.ms.of(self.kind);
        let readable = readable.filter(|_| self.min_ms > 0.0 && self.kind != Stage::Iteration);
        Self {
            floor_ms,
            percent_of_floor: floor_ms.map(|floor_ms| 100.0 * floor_ms / self.min_ms),
            times_readable: readable.map(|readable| readable / self.min_ms),
            ..self
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |number| format!("{number:.digits$}"))
        };
        write!(
            f,
            "| {:7} | {:>6} | {:13} | {:8} | {:>7} | {:>8.3} | {:>8.3} | {:>8.3} | {:>8} | {:>10} | {:>10} | {:>9} | {:>5} |",
            self.image,
            format!("{0}x{0}", self.filter),
            self.stage,
            self.isa,
            self.threads,
            self.min_ms,
            self.median_ms,
            self.cpu_ms,
            shown(self.floor_ms, 3),
            shown(self.percent_of_floor, 0),
            shown(self.times_readable, 1),
            shown(self.times_authors, 1),
            shown(self.times_parts_based_detector, 1),
        )
    }
}

/// All measurements of a run.
pub(crate) struct Table {
    machine: String,
    commit: String,
    pub(crate) rows: Vec<Row>,
    /// Peak rates, one for every image, filter size and instruction set.
    pub(crate) peaks: Vec<Peaks>,
}

impl Table {
    pub(crate) fn new(options: &Options) -> Self {
        let first = |path: &str, begin: &str| {
            let text = fs::read_to_string(path).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix(begin));
            line.map_or_else(|| "unknown".to_owned(), str::to_owned)
        };
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let cpu = first("/proc/cpuinfo", "model name\t: ");
        let load = first("/proc/loadavg", "");
        let load = load.split(' ').next().unwrap_or_default();
        Self {
            machine: format!("{cpu}, {cores} cores, load average {load} at the start"),
            commit: options.commit.clone(),
            rows: Vec::new(),
            peaks: Vec::new(),
        }
    }

    pub(crate) fn head(&self) -> String {
        let names = "| image   | filter | stage         | isa      | threads |   min ms |   median |   cpu ms \
                     | floor ms | % of floor | x readable | x authors | x PBD |";
        format!(
            "commit {}, {}\n\n{names}\n|---|---|---|---|---|---|---|---|---|---|---|---|---|",
            self.commit, self.machine
        )
    }

    /// Returns the text below the table: the peak rates from which the lower limits were computed.
    pub(crate) fn foot(&self) -> String {
        let peak = |peaks: &Peaks| {
            let Peaks {
                isa,
                multiply_add,
                max_plus,
            } = peaks;
            format!("{isa} {multiply_add:.0} and {max_plus:.0}")
        };
        let peaks: Vec<_> = self.peaks.iter().map(peak).collect();
        format!(
            "\nPeaks beside them, multiply-adds and max-plus a nanosecond on one thread: {}.",
            peaks.join(", ")
        )
    }

    pub(crate) fn json(&self) -> String {
        let all = serde_json::json!({
            "commit": self.commit,
            "machine": self.machine,
            "peaks_per_ns": self.peaks,
            "rows": self.rows,
        });
        serde_json::to_string_pretty(&all).unwrap()
    }

    /// Adds the table to the record.
    pub(crate) fn record(&self) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/record/stages.md");
        let mut text = fs::read_to_string(&path).unwrap_or_else(|_| {
            "# Stages of a frame\n\n`scripts/bench --record`; `scripts/bench --help` explains the columns.\n"
                .to_owned()
        });
        let rows = self.rows.iter().map(|row| format!("{row}\n"));
        let rows: String = rows.collect();
        text.extend(["\n## ", &self.head(), "\n", &rows, &self.foot(), "\n"]);
        fs::write(path, text).unwrap();
    }
}
