//! Observes the processes of a running deployment, and their metrics, from another process.

mod describe;
mod snapshot;
mod table;

use core::time::Duration;
use std::path::Path;
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use runtime::{Namespace, Observer, ObserverError, deployments, wait_for_description};

pub use describe::{describe, measured};
pub use snapshot::{ProcessSnapshot, Snapshot, State};
pub use table::table;

use crate::load;
use crate::resolved::Resolved;

/// Time that a deployment may take to start. When it publishes its description, all its topics exist.
const STARTING: Duration = Duration::from_secs(10);
/// Time to wait for the first metrics of all processes.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(20);

/// An observer of a running deployment.
#[derive(Debug)]
pub struct Live {
    name: String,
    observer: Observer,
}

impl Live {
    /// Connects to a running deployment. If the deployment is starting, waits until its processes are complete, at most ten seconds.
    ///
    /// # Errors
    ///
    /// Fails if the deployment is not running, or its topics cannot be opened.
    pub fn open(namespace: &Namespace) -> Result<Self, Failure> {
        if !wait_for_description(namespace, STARTING) {
            let name = namespace.name().to_owned();
            return Err(ObserverError::NotRunning { name }.into());
        }
        Ok(Self {
            name: namespace.name().to_owned(),
            observer: Observer::open(namespace)?,
        })
    }

    /// Returns the current state of all processes.
    ///
    /// # Errors
    ///
    /// Fails if the metrics cannot be received.
    pub fn snapshot(&mut self) -> Result<Snapshot, Failure> {
        let supervisor = self.observer.supervisor();
        let observed = self.observer.observe()?;
        Ok(Snapshot::new(
            &self.name,
            supervisor,
            &observed,
            now_nanos(),
        ))
    }

    /// Returns the state like [`Self::snapshot`], but first waits until every live process has sent metrics, at most two seconds.
    ///
    /// # Errors
    ///
    /// Fails like [`Self::snapshot`].
    pub fn first_snapshot(&mut self) -> Result<Snapshot, Failure> {
        let begin = Instant::now();
        loop {
            let snapshot = self.snapshot()?;
            if snapshot.is_complete() || begin.elapsed() > PATIENCE || self.is_over() {
                return Ok(snapshot);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Returns true if the deployment is ending. The observer must then be dropped.
    pub fn is_over(&self) -> bool {
        self.observer.is_over()
    }
}

/// Returns the namespace of a running deployment.
///
/// * `named`: name or file of the deployment; `None` for the only running deployment.
///
/// # Errors
///
/// Fails if the file cannot be read, or the name is not valid. Without a name, also fails if no deployment or several are running.
pub fn namespace(named: Option<&str>) -> Result<Namespace, Failure> {
    if let Some(named) = named {
        let is_file = Path::new(named).extension().is_some_and(|extension| extension == "toml");
        let name = if is_file {
            load::read(Path::new(named), &[])?.deployment.name
        } else {
            named.to_owned()
        };
        return Namespace::new(&name).or_fail(ExitKind::Usage);
    }
    let mut running = deployments(&Namespace::usual_base())?;
    running.retain(|deployment| deployment.supervisor.is_some());
    if running.len() > 1 {
        let names: Vec<&str> = running.iter().map(|running| running.namespace.name()).collect();
        let message = format!(
            "{} deployments are running: {}",
            names.len(),
            names.join(", ")
        );
        return Err(
            Failure::new(ExitKind::Usage, message).with_hint("give the name of one of them")
        );
    }
    let none = || Failure::new(ExitKind::Usage, "no deployment is running");
    running.pop().map(|running| running.namespace).ok_or_else(none)
}

/// Returns the description that a running deployment publishes: its settings, without passwords of cameras.
///
/// # Errors
///
/// Fails if the deployment is not running, or has another version.
pub fn description(namespace: &Namespace) -> Result<Resolved, Failure> {
    let name = namespace.name();
    let text = namespace.description().map_err(|error| {
        let text = format!("deployment {name:?} has no description: {error}");
        Failure::new(ExitKind::Usage, text)
    })?;
    serde_json::from_str(&text).map_err(|error| {
        let text = format!("the description of deployment {name:?} cannot be read: {error}");
        Failure::new(ExitKind::Run, text)
    })
}
