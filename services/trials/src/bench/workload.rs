//! Deployment of a load benchmark, and measurements of its runs.

use core::fmt::{self, Display, Formatter};
use std::fs;
use std::path::PathBuf;

use deployment::Deployment;
use deployment::paper::Errors;
use failure::{ExitKind, Failure, OrFail as _, Stop, now_nanos};
use launch::{Planned, Report, load};
use runfiles::Percentiles;
use scene::Action;
use serde_json::{Value, json};
use terminal::output::Verbosity;

use super::options::Options;
use super::pictures;
use crate::spread::Spread;
use crate::trial::injection::{Injector, ProcessFault};
use crate::trial::results::{self, FrameResult};
use crate::trial::synthetic::{self, Finder, N_CAMERAS, SyntheticDeployment, SyntheticSetup};

/// Time that a stage waits for a late view of synthetic cameras, in milliseconds.
const DEADLINE_MS: u64 = 500;
/// Stages whose computing time is measured, in pipeline order.
const STAGES: [&str; 5] = ["capture", "pose", "quality", "fuse", "triangulate"];
/// Ticks per second in the kernel's counts of processor time (`USER_HZ`).
const TICKS_HZ: f64 = 100.0;

/// A kind of run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Case {
    /// Number of cameras.
    pub n_views: usize,
    /// True to process every frame as fast as possible.
    pub is_lossless: bool,
    /// True to kill the process of the last camera.
    pub has_dead: bool,
}

impl Display for Case {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let plural = if self.n_views == 1 { "" } else { "s" };
        write!(f, "{} view{plural}", self.n_views)?;
        f.write_str(match (self.is_lossless, self.has_dead) {
            (_, true) => ", one camera killed",
            (true, false) => ", every frame",
            (false, false) => "",
        })
    }
}

impl Case {
    /// Returns the name of the output folder.
    fn folder(self) -> String {
        self.to_string().replace(", ", "-").replace(' ', "-")
    }

    /// Returns the `key=value` pairs that replace values of the deployment.
    fn set(self) -> Vec<&'static str> {
        let mut set = if self.is_lossless {
            vec!["capture.mode=lossless"]
        } else {
            vec!["capture.mode=realtime"]
        };
        if self.has_dead {
            set.push("supervise.max_restarts=0");
        }
        set
    }
}

/// Measurements of a run.
#[derive(Debug)]
pub(super) struct Measured {
    /// The kind of run.
    pub case: Case,
    /// Number of results. If a camera is killed, only results after the kill are counted.
    pub n_results: usize,
    /// Results per second, from the first result to the last.
    pub rate_hz: Option<f64>,
    /// Time from the capture of the first picture to the result, in milliseconds.
    pub end_to_end: Option<Spread>,
    /// Computing time of every stage over the whole run, in milliseconds.
    pub stages: Vec<(&'static str, Spread)>,
    /// Processor time of all processes over the whole run, in seconds.
    pub cpu_seconds: f64,
    /// Number of frames and messages that were dropped.
    pub n_dropped: u64,
    /// The report of `launch` as JSON.
    pub run: Value,
}

impl Measured {
    /// Returns the processor time per result, in milliseconds. `None` for a run with a killed camera, because results before the kill are
    /// not counted.
    pub(super) fn cpu_ms_per_result(&self) -> Option<f64> {
        let is_whole = self.n_results > 0 && !self.case.has_dead;
        is_whole.then(|| 1e3 * self.cpu_seconds / self.n_results as f64)
    }

    /// Returns the measurements as JSON.
    pub(super) fn json(&self) -> Value {
        let stages = self.stages.iter();
        let stages = stages.map(|(name, spread)| ((*name).to_owned(), json!(spread)));
        json!({
            "run": self.case.to_string(),
            "views": self.case.n_views,
            "one_dead": self.case.has_dead,
            "results": self.n_results,
            "rate_hz": self.rate_hz,
            "end_to_end_ms": self.end_to_end,
            "stages_ms": stages.collect::<serde_json::Map<_, _>>(),
            "cpu_seconds": self.cpu_seconds,
            "dropped": self.n_dropped,
            "summary": self.run,
        })
    }
}

/// Deployment of a load benchmark.
#[derive(Debug)]
pub(super) struct Workload {
    /// The deployment file.
    file: PathBuf,
    /// Absolute folder for the results, with a subfolder for each run.
    folder: PathBuf,
    /// Folder of pictures rendered in advance, with a subfolder for each camera.
    pictures: Option<PathBuf>,
    /// `key=value` pairs that replace values of the file in all runs.
    set: Vec<String>,
    n_views: usize,
    verbosity: Verbosity,
}

impl Workload {
    /// Reads the deployment, or writes one with synthetic cameras. Returns `None` if the benchmark was interrupted.
    pub(super) fn new(
        options: &Options,
        verbosity: Verbosity,
        stop: &Stop,
    ) -> Result<Option<Self>, Failure> {
        let folder = synthetic::absolute(&options.out)?;
        inputs::make_folder(&folder)?;
        let name = toml::Value::from(options.name.clone());
        let mut set = options.set.clone();
        set.extend([format!("name={name}"), "results.overlay_every=0".to_owned()]);
        if options.spin {
            set.push("runtime.spin=true".to_owned());
        }
        let mut workload = Self {
            file: PathBuf::new(),
            folder,
            pictures: None,
            set,
            n_views: options.views.unwrap_or(N_CAMERAS),
            verbosity,
        };
        let is_ready = match &options.deployment {
            Some(file) => {
                workload.file = synthetic::absolute(file)?;
                workload.shorten(options)?;
                true
            }
            None => workload.write_synthetic(options, stop)?,
        };
        Ok(is_ready.then_some(workload))
    }

    /// Returns the largest number of cameras in a run.
    pub(super) fn n_views(&self) -> usize {
        self.n_views
    }

    /// Writes a deployment with synthetic cameras, and the pictures of the cameras. Returns false if the benchmark was interrupted.
    fn write_synthetic(&mut self, options: &Options, stop: &Stop) -> Result<bool, Failure> {
        let n_frames = (options.rate_hz * f64::from(options.seconds)).round() as u64;
        let setup = SyntheticSetup {
            subject: 1,
            action: Action::Walking,
            passers: 0,
            seed: options.seed,
            rate_hz: options.rate_hz,
            n_frames: n_frames.max(1),
            n_cameras: self.n_views,
            deadline_ms: DEADLINE_MS,
            finder: Finder::TrackingFilters,
            name: "bench",
            command: "bench",
        };
        let synthetic = SyntheticDeployment::new(&setup, self.folder.clone())?;
        self.file = synthetic.write(&setup)?;
        if options.live {
            return Ok(true);
        }
        let folder = self.folder.join("pictures");
        let is_done = pictures::draw(
            &synthetic.settings,
            setup.n_frames,
            &folder,
            stop,
            self.verbosity.quiet,
        )?;
        self.pictures = Some(folder);
        Ok(is_done)
    }

    /// Limits the duration of the footage. Fails if more cameras are requested than exist.
    fn shorten(&mut self, options: &Options) -> Result<(), Failure> {
        let deployment = load::read(&self.file, &self.set)?.deployment;
        let n_cameras = deployment.cameras.len();
        self.n_views = options.views.unwrap_or(n_cameras);
        if self.n_views > n_cameras {
            let message = format!(
                "--views {}: the deployment has only {n_cameras} cameras",
                self.n_views
            );
            return Err(Failure::new(ExitKind::Usage, message));
        }
        let planned = Planned::new(&deployment, self.verbosity.level)?;
        let resolved = planned.resolved();
        if let Some(hz) = resolved.frame_rate_hz() {
            let step = deployment.capture.frame_step.max(1) as f64;
            let n_frames = ((hz * f64::from(options.seconds) / step) as u64).max(1);
            if n_frames < resolved.n_frames() {
                self.set.push(format!("capture.n_frames={n_frames}"));
            }
        }
        Ok(())
    }

    /// Returns the deployment of a run.
    fn deployment(&self, case: Case) -> Result<Deployment, Failure> {
        let more = case.set().into_iter().map(str::to_owned);
        let set: Vec<String> = self.set.iter().cloned().chain(more).collect();
        let mut deployment = load::read(&self.file, &set)?.deployment;
        deployment.output = self.folder.join(case.folder());
        keep_views(&mut deployment, case.n_views);
        if let Some(folder) = &self.pictures {
            for camera in &mut deployment.cameras {
                camera.source = folder.join(&camera.name).to_string_lossy().into_owned();
            }
        }
        Ok(deployment)
    }

    /// Runs the deployment and measures it. Returns `None` if the benchmark was interrupted.
    pub(super) fn measure(&self, case: Case, stop: &Stop) -> Result<Option<Measured>, Failure> {
        let deployment = self.deployment(case)?;
        let planned = Planned::new(&deployment, self.verbosity.level)?;
        let victim = format!("capture-{}", case.n_views - 1);
        let mut injector = case.has_dead.then(|| Injector::new(ProcessFault::Kill, &victim, 0.0));
        let before = cpu_seconds_of_children()?;
        let report = planned.run(self.verbosity.quiet, stop, &mut |event| {
            injector
                .as_mut()
                .and_then(|injector| injector.handle(event, now_nanos(), ProcessFault::inject))
        })?;
        let cpu_seconds = cpu_seconds_of_children()? - before;
        if stop.is_requested() {
            return Ok(None);
        }
        let names: Vec<String> =
            deployment.cameras.iter().map(|camera| camera.name.clone()).collect();
        let mut results = results::read(&deployment.output, &names)?;
        if let Some(injector) = &injector {
            let killed = injector.times().injected;
            let since = killed.map_or(f64::INFINITY, |killed| {
                killed.saturating_sub(planned.session()) as f64 / 1e6
            });
            results.retain(|result| {
                result.captured_ms().is_some_and(|captured_ms| captured_ms > since)
            });
        }
        Ok(Some(measured(case, &results, cpu_seconds, &report)))
    }
}

fn measured(case: Case, results: &[FrameResult], cpu_seconds: f64, report: &Report) -> Measured {
    let took = |result: &FrameResult| Some(result.sent_ms - result.captured_ms()?);
    let run = report.json();
    let stages = report.recorded().latency().map(|latency| &latency.stages);
    Measured {
        case,
        n_results: results.len(),
        rate_hz: rate_hz(results),
        end_to_end: Spread::of(results.iter().filter_map(took).collect()),
        stages: STAGES
            .into_iter()
            .filter_map(|stage| Some((stage, spread(stages?.get(stage)?))))
            .collect(),
        cpu_seconds,
        n_dropped: run["dropped"].as_u64().unwrap_or(0),
        run,
    }
}

/// Returns the results per second, from the first result to the last.
fn rate_hz(results: &[FrameResult]) -> Option<f64> {
    let sent = || results.iter().map(|result| result.sent_ms);
    let (first, last) = (sent().reduce(f64::min)?, sent().reduce(f64::max)?);
    (last > first).then(|| 1e3 * (results.len() - 1) as f64 / (last - first))
}

/// Converts percentiles of the latency report.
fn spread(percentiles: &Percentiles) -> Spread {
    Spread {
        n: percentiles.count as usize,
        p50: percentiles.p50_ms,
        p99: percentiles.p99_ms,
        p99_9: percentiles.p99_9_ms,
        max: percentiles.max_ms,
    }
}

/// Keeps the first cameras, and removes settings that name other cameras.
fn keep_views(deployment: &mut Deployment, n_views: usize) {
    deployment.cameras.truncate(n_views);
    let names: Vec<String> = deployment.cameras.iter().map(|camera| camera.name.clone()).collect();
    let is_kept = |name: &String| names.contains(name);
    deployment.paper.pairs.retain(|pair| pair.iter().all(is_kept));
    deployment.paper.compatibility.retain(|entry| entry.views.iter().all(is_kept));
    if let Some(Errors::Table(table)) = &mut deployment.paper.errors {
        table.views.retain(|name, _| is_kept(name));
    }
}

/// Returns the processor time of all child processes that have ended, in seconds.
fn cpu_seconds_of_children() -> Result<f64, Failure> {
    let stat = fs::read_to_string("/proc/self/stat").or_fail(ExitKind::Run)?;
    let seconds = parse_stat(&stat).ok_or("/proc/self/stat has an unexpected format");
    seconds.or_fail(ExitKind::Run)
}

/// Returns the sum of fields 16 and 17 of `/proc/PID/stat` (`proc_pid_stat(5)`), in seconds. Fields are counted from the end of the
/// name, which may contain any character.
fn parse_stat(stat: &str) -> Option<f64> {
    let (_, fields) = stat.rsplit_once(") ")?;
    let mut fields = fields.split(' ').skip(13);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_HZ)
}

#[cfg(test)]
mod tests {
    use runfiles::CameraTimes;

    use super::*;
    use crate::trial::results::ViewResult;

    fn moment(captured_ms: f64, sent_ms: f64) -> FrameResult {
        let camera = CameraTimes {
            epoch: 0,
            captured_ms,
            sent_ms: captured_ms + 1.0,
        };
        FrameResult {
            frame: 0,
            epoch: 0,
            sent_ms,
            people: Vec::new(),
            views: vec![ViewResult {
                camera: Some(camera),
                ..ViewResult::default()
            }],
        }
    }

    #[test]
    fn the_rate_is_measured_from_the_first_to_the_last_result() {
        let results = [0.0, 100.0, 250.0, 400.0].map(|value| moment(value, value + 30.0));
        assert_eq!(rate_hz(&results), Some(7.5));
        assert_eq!(rate_hz(&results[..1]), None);
        assert_eq!(rate_hz(&[]), None);
    }

    #[test]
    fn the_name_of_a_program_may_contain_any_character() {
        let stat = "7 (a) b) S 1 2 3 4 5 6 7 8 9 10 1100 1200 250 50 20 0";
        assert_eq!(parse_stat(stat), Some(3.0));
        assert_eq!(parse_stat("7 (a) S 1 2"), None);
        assert!(
            cpu_seconds_of_children().is_ok_and(|cpu_seconds_of_child| cpu_seconds_of_child >= 0.0)
        );
    }

    #[test]
    fn percentiles_are_converted_without_change() {
        let written = Percentiles {
            count: 3,
            max_ms: 4.0,
            p50_ms: 1.0,
            p99_9_ms: 3.0,
            p99_ms: 2.0,
        };
        let expected = Spread {
            n: 3,
            p50: 1.0,
            p99: 2.0,
            p99_9: 3.0,
            max: 4.0,
        };
        assert_eq!(spread(&written), expected);
    }

    #[test]
    fn the_folder_of_a_run_is_named_after_it() {
        let case = Case {
            n_views: 2,
            is_lossless: false,
            has_dead: true,
        };
        assert_eq!(case.folder(), "2-views-one-camera-killed");
    }
}
