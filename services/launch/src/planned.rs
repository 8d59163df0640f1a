//! A deployment that can be started, and its run.

use std::path::PathBuf;
use std::time::Instant;

use deployment::Deployment;
use runtime::{Failure, Scheduling, Stop};
use supervise::{Event, Plan};
use tracing::Level;

use crate::claim::Claim;
use crate::inputs;
use crate::plan;
use crate::prepare::Prepared;
use crate::resolved::Resolved;
use crate::scheduling;
use crate::summary::{Report, Watcher};

/// A deployment that can be started.
#[derive(Debug)]
pub struct Planned {
    /// What every process is given.
    resolved: Resolved,
    /// Its processes and topics.
    plan: Plan,
}

impl Planned {
    /// Reads what the deployment names, and deals the work to processes.
    ///
    /// * `log`: the least important events that its processes log.
    ///
    /// # Errors
    ///
    /// Something that it names cannot be read or used; see [`plan::resolve`] and [`Self::of`].
    pub fn new(deployment: &Deployment, log: Level) -> Result<Self, Failure> {
        Self::of(plan::resolve(deployment)?, log)
    }

    /// Deals the work of a deployment whose footage is known to processes.
    ///
    /// # Errors
    ///
    /// Model, calibration or predictions cannot be read or used.
    pub fn of(resolved: Resolved, log: Level) -> Result<Self, Failure> {
        let prepared = Prepared::new(&resolved)?;
        prepared.check_predictions(&resolved)?;
        let file = file_of(&resolved.deployment);
        if let Some(padding) = &prepared.padding {
            tracing::warn!("{padding}");
        }
        let mut plan = plan::plan(&resolved, &prepared, &file, log)?;
        for warning in scheduling::permit(&mut plan.processes, Scheduling::rehearse) {
            tracing::warn!("{warning}");
        }
        Ok(Self { resolved, plan })
    }

    /// What every process is given.
    pub fn resolved(&self) -> &Resolved {
        &self.resolved
    }

    /// Its processes and topics.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The run, which is the time of its planning too: `runtime::now_nanos`.
    pub fn session(&self) -> u64 {
        self.plan.session
    }

    /// Its processes.
    pub fn processes(&self) -> impl Iterator<Item = &str> {
        self.plan.processes.iter().map(|it| it.name.as_str())
    }

    /// Has a process compute for ever in its first life, once it has sent something of a later frame.
    pub fn spin(&mut self, process: &str, after_frame: u64) {
        let spec = self.plan.processes.iter_mut().find(|it| it.name == process);
        if let Some(it) = spec {
            let args = ["--spin-after".to_owned(), after_frame.to_string()];
            it.args.extend(args.map(Into::into));
        }
    }

    /// Runs it, shows its progress, and says what became of it.
    ///
    /// * `quiet`: shows nothing, nor what the onlooker answers.
    /// * `stop`: ends it before its footage does.
    /// * `onlooker`: is told everything that happens; what it answers is shown.
    ///
    /// # Errors
    ///
    /// The folder of the results cannot be made or is another run's; the processes cannot be started or supervised.
    pub fn carry_out(
        &self,
        quiet: bool,
        stop: &Stop,
        onlooker: &mut dyn FnMut(&Event<'_>) -> Option<String>,
    ) -> Result<Report, Failure> {
        let deployment = &self.resolved.deployment;
        let folder = &deployment.output;
        inputs::make_folder(folder)?;
        let _mine = Claim::of(folder, &format!("deployment {}", deployment.name))?;
        self.resolved.write(&file_of(deployment))?;
        let begin = Instant::now();
        let mut watcher = Watcher::new(&self.resolved, quiet);
        let outcome = supervise::run(&self.plan, stop, &mut |event| {
            watcher.note(&event);
            if let Some(said) = onlooker(&event).filter(|_| !quiet) {
                watcher.say(&said);
            }
        });
        watcher.finish();
        let elapsed = begin.elapsed();
        Ok(Report::new(
            &self.resolved,
            self.plan.session,
            &outcome?,
            elapsed,
        ))
    }
}

/// The resolved deployment, for the user; the processes are given the same in their standard input.
fn file_of(deployment: &Deployment) -> PathBuf {
    deployment.output.join("deployment.json")
}
