//! A planned deployment, and its run.

use std::path::PathBuf;
use std::time::Instant;

use deployment::Deployment;
use failure::{Claim, Failure, Stop, now_nanos};
use runtime::Scheduling;
use supervise::{Event, Plan};
use tracing::Level;

use crate::plan;
use crate::prepare::Prepared;
use crate::resolved::Resolved;
use crate::scheduling;
use crate::search_size::SearchSize;
use crate::summary::{Report, Watcher};

/// A deployment with the plan of its run.
#[derive(Debug)]
pub struct Planned {
    /// The resolved deployment, which every process gets as input.
    resolved: Resolved,
    /// Processes and topics of the run.
    plan: Plan,
}

impl Planned {
    /// Resolves a deployment, and plans its processes and topics.
    ///
    /// * `log`: the log level of its processes.
    ///
    /// # Errors
    ///
    /// Fails if an input cannot be read or used; see [`plan::resolve`] and [`Self::begun`].
    pub fn new(deployment: &Deployment, log: Level) -> Result<Self, Failure> {
        Self::begun(plan::resolve(deployment)?, log, None)
    }

    /// Plans the processes and topics of a resolved deployment.
    ///
    /// * `log`: the log level of its processes.
    /// * `session`: start of the run according to the fusing host; `None` if the run begins here.
    ///
    /// # Errors
    ///
    /// Fails if the model, calibration, network or table of expected errors cannot be read or used.
    pub fn begun(resolved: Resolved, log: Level, session: Option<u64>) -> Result<Self, Failure> {
        let prepared = Prepared::new(&resolved)?;
        prepared.check_predictions(&resolved)?;
        let file = resolved_file(&resolved.deployment);
        if let Some(padding) = &prepared.padding {
            tracing::warn!("{padding}");
        }
        if let Some(small) = resolved.search_size.as_ref().and_then(SearchSize::warning) {
            tracing::warn!("{small}");
        }
        let session = session.unwrap_or_else(now_nanos);
        let mut plan = plan::plan(&resolved, &prepared, &file, (log, session))?;
        for warning in scheduling::remove_denied(&mut plan.processes, Scheduling::rehearse) {
            tracing::warn!("{warning}");
        }
        Ok(Self { resolved, plan })
    }

    /// Returns the resolved deployment, which every process gets as input.
    pub fn resolved(&self) -> &Resolved {
        &self.resolved
    }

    /// Returns the plan of processes and topics.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the session, which is the time of planning (`failure::now_nanos`).
    pub fn session(&self) -> u64 {
        self.plan.session
    }

    /// Returns the names of the processes.
    pub fn processes(&self) -> impl Iterator<Item = &str> {
        self.plan.processes.iter().map(|process| process.name.as_str())
    }

    /// Makes a process enter an endless loop in epoch 0, after it has sent a message about a frame later than `after_frame`.
    pub fn spin(&mut self, process: &str, after_frame: u64) {
        let spec = self.plan.processes.iter_mut().find(|spec| spec.name == process);
        if let Some(spec) = spec {
            let args = ["--spin-after".to_owned(), after_frame.to_string()];
            spec.args.extend(args.map(Into::into));
        }
    }

    /// Runs the deployment, shows its progress, and reports on it.
    ///
    /// * `quiet`: true to hide the progress and the messages of `on_event`.
    /// * `stop`: ends the run early.
    /// * `on_event`: called for every event of the run. If it returns a message, the message is shown.
    ///
    /// # Errors
    ///
    /// Fails if the output folder cannot be created, another run uses it, or the processes cannot be started or supervised.
    pub fn run(
        &self,
        quiet: bool,
        stop: &Stop,
        on_event: &mut dyn FnMut(&Event<'_>) -> Option<String>,
    ) -> Result<Report, Failure> {
        let deployment = &self.resolved.deployment;
        let folder = &deployment.output;
        inputs::make_folder(folder)?;
        let _claim = Claim::take(folder, &format!("deployment {}", deployment.name))?;
        self.resolved.write(&resolved_file(deployment))?;
        let begin = Instant::now();
        let mut watcher = Watcher::new(&self.resolved, quiet);
        let outcome = supervise::run(&self.plan, stop, &mut |event| {
            watcher.handle(&event);
            if let Some(message) = on_event(&event).filter(|_| !quiet) {
                watcher.print(&message);
            }
        });
        watcher.finish();
        let elapsed = begin.elapsed();
        let report = Report::new(&self.resolved, self.plan.session, &outcome?, elapsed);
        if let Err(failure) = report.write_page(&self.resolved) {
            tracing::warn!(%failure, "the page of the run could not be written");
        }
        Ok(report)
    }
}

/// Returns the path of the resolved deployment in the output folder. The file is for the user; processes get the same content on
/// standard input.
fn resolved_file(deployment: &Deployment) -> PathBuf {
    deployment.output.join("deployment.json")
}
