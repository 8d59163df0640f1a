//! The deployment that is put to the test, and one run of it.

use std::path::PathBuf;

use deployment::Deployment;
use launch::output::Verbosity;
use launch::{Planned, Report, inputs, load};
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use scene::Action;
use serde_json::Value;
use supervise::Event;

use super::census;
use super::judge::Aftermath;
use super::options::Options;
use crate::trial::results::{self, Moment};
use crate::trial::stage::{self, Cast, N_CAMERAS, Stage};

/// Of the cameras that do not exist: frames a second, and how long a stage waits for a view that is late.
const RATE_HZ: f64 = 5.0;
const DEADLINE_MS: u64 = 500;

/// The deployment that is put to the test.
#[derive(Debug)]
pub(super) struct Ground {
    /// Its file.
    pub file: PathBuf,
    /// For the results, a folder for every scenario; absolute.
    pub folder: PathBuf,
    /// What is replaced in the file.
    pub set: Vec<String>,
    /// How much is said.
    pub verbosity: Verbosity,
    /// Ends everything.
    pub stop: Stop,
}

/// A run that is over.
#[derive(Debug)]
pub(super) struct Ran {
    /// What its summary said.
    pub report: Result<Report, Failure>,
    /// Its results.
    pub moments: Vec<Moment>,
    /// What it left in shared memory.
    pub left: Vec<String>,
}

impl Ground {
    /// Looks at the deployment, or makes the one with cameras that do not exist.
    pub(super) fn new(options: &Options, verbosity: Verbosity) -> Result<Self, Failure> {
        let folder = stage::absolute(&options.out)?;
        inputs::make_folder(&folder)?;
        let mut ground = Self {
            file: PathBuf::new(),
            folder,
            set: Vec::new(),
            verbosity,
            stop: Stop::on_signals().or_fail(ExitKind::Run)?,
        };
        let mut name = options.name.clone();
        if let Some(file) = &options.deployment {
            ground.file = stage::absolute(file)?;
            let its_name = ground.shorten(options.seconds)?;
            name.get_or_insert(format!("{its_name}-chaos"));
        } else {
            ground.file = ground.play(options)?;
        }
        if let Some(name) = name {
            ground.set.push(format!("name={}", toml::Value::from(name)));
        }
        let more = ["results.overlay_every=0", "supervise.max_restarts=1000"];
        ground.set.extend(more.map(str::to_owned));
        Ok(ground)
    }

    /// Writes the deployment with cameras that do not exist; its file.
    fn play(&self, options: &Options) -> Result<PathBuf, Failure> {
        let cast = Cast {
            subject: 1,
            action: Action::Walking,
            seed: options.seed,
            rate_hz: RATE_HZ,
            n_frames: (RATE_HZ * f64::from(options.seconds)) as u64,
            n_cameras: N_CAMERAS,
            deadline_ms: DEADLINE_MS,
            name: "chaos",
            command: "chaos",
        };
        Stage::new(&cast, self.folder.clone())?.write(&cast)
    }

    /// Takes no more of the footage than some seconds; the name of the deployment.
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

    /// What is replaced in the file for a scenario.
    pub(super) fn set(&self, more: &[&str]) -> Vec<String> {
        let more = more.iter().copied().map(str::to_owned);
        self.set.iter().cloned().chain(more).collect()
    }

    /// Its folder.
    pub(super) fn output(&self, scenario: &str) -> PathBuf {
        self.folder.join(scenario)
    }

    /// Plans a run of the deployment.
    ///
    /// * `more`: what else is replaced in the file.
    pub(super) fn plan(&self, scenario: &str, more: &[&str]) -> Result<Planned, Failure> {
        self.plan_with(scenario, more, &|_| ())
    }

    /// As [`Self::plan`].
    ///
    /// * `change`: what keys cannot say.
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

    /// Runs it to its end, whatever that is.
    ///
    /// * `onlooker`: as that of [`Planned::run`].
    pub(super) fn watch(
        &self,
        planned: &Planned,
        onlooker: &mut dyn FnMut(&Event<'_>) -> Option<String>,
    ) -> Ran {
        let report = planned.run(self.verbosity.quiet, &self.stop, onlooker);
        let deployment = &planned.resolved().deployment;
        let names = deployment.cameras.iter().map(|it| it.name.clone());
        let names: Vec<String> = names.collect();
        let read = |report| {
            let moments = results::read(&deployment.output, &names)?;
            Ok((report, moments))
        };
        let (report, moments) = match report.and_then(read) {
            Ok((report, moments)) => (Ok(report), moments),
            Err(failure) => (Err(failure), Vec::new()),
        };
        let namespace = &planned.plan().namespace;
        let mut left = census::left(namespace);
        left.extend(
            namespace
                .root()
                .exists()
                .then(|| namespace.root().display().to_string()),
        );
        Ran {
            report,
            moments,
            left,
        }
    }
}

impl Ran {
    /// What is to be judged.
    ///
    /// * `struck`: how often a process was.
    pub(super) fn aftermath(&self, struck: impl Fn(&str) -> u32) -> Aftermath {
        let report = self.report.as_ref().ok();
        Aftermath {
            failure: self.report.as_ref().err().map(ToString::to_string),
            n_results: self.moments.len(),
            unanswered: report.map_or(0, |it| it.views().iter().map(|it| it.unanswered).sum()),
            failed: report.map_or_else(Vec::new, |it| it.unexpected_failures(struck)),
            left: self.left.clone(),
            accused: report.map_or_else(Vec::new, Report::misplaced),
        }
    }

    /// For programs; null if the run failed.
    pub(super) fn json(&self) -> Value {
        self.report.as_ref().map_or(Value::Null, Report::json)
    }
}
