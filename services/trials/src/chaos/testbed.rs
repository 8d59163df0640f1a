//! The deployment under test and its runs.

use std::path::PathBuf;

use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::{Planned, Report, load};
use scene::Action;
use serde_json::Value;
use supervise::Event;
use terminal::output::Verbosity;

use super::judge::RunOutcome;
use super::options::Options;
use super::resources;
use crate::trial::results::{self, FrameResult};
use crate::trial::synthetic::{self, Finder, N_CAMERAS, SyntheticDeployment, SyntheticSetup};

/// Frames per second of the synthetic cameras.
const RATE_HZ: f64 = 5.0;
/// Time that a stage waits for a late view of the synthetic cameras, in milliseconds.
const DEADLINE_MS: u64 = 500;

/// The deployment under test.
#[derive(Debug)]
pub(super) struct Testbed {
    /// The deployment file.
    pub file: PathBuf,
    /// Absolute folder for the results, with a subfolder for each scenario.
    pub folder: PathBuf,
    /// `key=value` pairs that replace values of the file.
    pub set: Vec<String>,
    /// Verbosity of printed output and the log.
    pub verbosity: Verbosity,
    /// Stop request that ends the trial.
    pub stop: Stop,
}

/// A completed run.
#[derive(Debug)]
pub(super) struct CompletedRun {
    /// Report of the run, or the reason why it failed.
    pub report: Result<Report, Failure>,
    /// Results of the run.
    pub results: Vec<FrameResult>,
    /// Files that the run left behind.
    pub leftovers: Vec<String>,
}

impl Testbed {
    /// Reads the deployment, or writes one with synthetic cameras.
    pub(super) fn new(options: &Options, verbosity: Verbosity) -> Result<Self, Failure> {
        let folder = synthetic::absolute(&options.out)?;
        inputs::make_folder(&folder)?;
        let mut testbed = Self {
            file: PathBuf::new(),
            folder,
            set: Vec::new(),
            verbosity,
            stop: Stop::on_signals().or_fail(ExitKind::Run)?,
        };
        let mut name = options.name.clone();
        if let Some(file) = &options.deployment {
            testbed.file = synthetic::absolute(file)?;
            let its_name = testbed.shorten(options.seconds)?;
            name.get_or_insert(format!("{its_name}-chaos"));
        } else {
            testbed.file = testbed.write_synthetic(options)?;
        }
        if let Some(name) = name {
            testbed.set.push(format!("name={}", toml::Value::from(name)));
        }
        let more = ["results.overlay_every=0", "supervise.max_restarts=1000"];
        testbed.set.extend(more.map(str::to_owned));
        Ok(testbed)
    }

    /// Writes a deployment with synthetic cameras, and returns its file.
    fn write_synthetic(&self, options: &Options) -> Result<PathBuf, Failure> {
        let setup = SyntheticSetup {
            subject: 1,
            action: Action::Walking,
            passers: 0,
            seed: options.seed,
            rate_hz: RATE_HZ,
            n_frames: (RATE_HZ * f64::from(options.seconds)) as u64,
            n_cameras: N_CAMERAS,
            deadline_ms: DEADLINE_MS,
            finder: Finder::TrackingFilters,
            name: "chaos",
            command: "chaos",
        };
        SyntheticDeployment::new(&setup, self.folder.clone())?.write(&setup)
    }

    /// Limits the duration of the footage, and returns the name of the deployment.
    fn shorten(&mut self, seconds: u32) -> Result<String, Failure> {
        let planned = self.plan("", &[])?;
        let resolved = planned.resolved();
        if let Some(hz) = resolved.frame_rate_hz() {
            let step = resolved.deployment.capture.frame_step.max(1) as f64;
            let n_frames = ((hz * f64::from(seconds) / step) as u64).max(1);
            if n_frames < resolved.n_frames() {
                self.set.push(format!("capture.n_frames={n_frames}"));
            }
        }
        Ok(resolved.deployment.name.clone())
    }

    /// Returns the `key=value` pairs of a scenario.
    ///
    /// * `more`: pairs in addition to the pairs of all scenarios.
    pub(super) fn set(&self, more: &[&str]) -> Vec<String> {
        let more = more.iter().copied().map(str::to_owned);
        self.set.iter().cloned().chain(more).collect()
    }

    /// Returns the output folder of a scenario.
    pub(super) fn output(&self, scenario: &str) -> PathBuf {
        self.folder.join(scenario)
    }

    /// Plans a run of the deployment.
    ///
    /// * `more`: additional `key=value` pairs.
    pub(super) fn plan(&self, scenario: &str, more: &[&str]) -> Result<Planned, Failure> {
        self.plan_with(scenario, more, &|_| ())
    }

    /// Plans a run like [`Self::plan`], with further changes.
    ///
    /// * `change`: changes that `key=value` pairs cannot express.
    pub(super) fn plan_with(
        &self,
        scenario: &str,
        more: &[&str],
        change: &dyn Fn(&mut Deployment),
    ) -> Result<Planned, Failure> {
        let mut loaded = load::read(&self.file, &self.set(more))?;
        loaded.deployment.output = self.output(scenario);
        change(&mut loaded.deployment);
        Planned::new(&loaded.deployment, self.verbosity.level)
    }

    /// Runs the deployment until it ends or fails.
    ///
    /// * `on_event`: see [`Planned::run`].
    pub(super) fn run(
        &self,
        planned: &Planned,
        on_event: &mut dyn FnMut(&Event<'_>) -> Option<String>,
    ) -> CompletedRun {
        let report = planned.run(self.verbosity.quiet, &self.stop, on_event);
        let deployment = &planned.resolved().deployment;
        let names = deployment.cameras.iter().map(|camera| camera.name.clone());
        let names: Vec<String> = names.collect();
        let read = |report| {
            let results = results::read(&deployment.output, &names)?;
            Ok((report, results))
        };
        let (report, results) = match report.and_then(read) {
            Ok((report, results)) => (Ok(report), results),
            Err(failure) => (Err(failure), Vec::new()),
        };
        let namespace = &planned.plan().namespace;
        let mut leftovers = resources::shared_files(namespace);
        leftovers.extend(namespace.root().exists().then(|| namespace.root().display().to_string()));
        CompletedRun {
            report,
            results,
            leftovers,
        }
    }
}

impl CompletedRun {
    /// Returns the outcome to check.
    ///
    /// * `n_faults`: returns the number of faults injected into a process.
    pub(super) fn outcome(&self, n_faults: impl Fn(&str) -> u32) -> RunOutcome {
        let report = self.report.as_ref().ok();
        RunOutcome {
            failure: self.report.as_ref().err().map(ToString::to_string),
            n_results: self.results.len(),
            unanswered: report.map_or(0, |report| {
                report.views().iter().map(|view| view.unanswered).sum()
            }),
            failed: report.map_or_else(Vec::new, |report| report.unexpected_failures(n_faults)),
            leftovers: self.leftovers.clone(),
            suspected: report.map_or_else(Vec::new, Report::misplaced),
        }
    }

    /// Returns the report as JSON; null if the run failed.
    pub(super) fn json(&self) -> Value {
        self.report.as_ref().map_or(Value::Null, Report::json)
    }
}
