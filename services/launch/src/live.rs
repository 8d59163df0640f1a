//! A running deployment, observed from another process: its processes and their metrics.

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

/// How long a deployment may take to begin: until it says what it is, its topics are not all there.
const STARTING: Duration = Duration::from_secs(10);
/// How long to wait for the first metrics of all processes.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(20);

/// Observes a deployment while it runs.
#[derive(Debug)]
pub struct Live {
    name: String,
    observer: Observer,
}

impl Live {
    /// Connects to a running deployment. One that is starting is waited for, at most ten seconds: before, it would be seen with a part
    /// of its processes.
    ///
    /// # Errors
    ///
    /// The deployment does not run, or its topics cannot be opened.
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

    /// The current state of all processes.
    ///
    /// # Errors
    ///
    /// The metrics cannot be received.
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

    /// As [`Self::snapshot`], but first waits until every live process has sent metrics, at most two seconds.
    ///
    /// # Errors
    ///
    /// As for [`Self::snapshot`].
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

    /// Returns true if the deployment is ending; the observer must then be dropped.
    pub fn is_over(&self) -> bool {
        self.observer.is_over()
    }
}

/// The namespace of a running deployment.
///
/// * `named`: its name or its file; none for the only running one.
///
/// # Errors
///
/// The file cannot be read, the name is not valid, or not exactly one deployment runs.
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
        let message = format!("{} deployments run: {}", names.len(), names.join(", "));
        return Err(Failure::new(ExitKind::Usage, message).with_hint("name one of them"));
    }
    let none = || Failure::new(ExitKind::Usage, "no deployment runs");
    running.pop().map(|running| running.namespace).ok_or_else(none)
}

/// Returns the description that a running deployment gives of itself: its settings, without passwords of cameras.
///
/// # Errors
///
/// It does not run, or is of another version.
pub fn description(namespace: &Namespace) -> Result<Resolved, Failure> {
    let name = namespace.name();
    let text = namespace.description().map_err(|error| {
        let text = format!("deployment {name:?} does not say what it is: {error}");
        Failure::new(ExitKind::Usage, text)
    })?;
    serde_json::from_str(&text).map_err(|error| {
        let text = format!("the description of deployment {name:?} cannot be read: {error}");
        Failure::new(ExitKind::Run, text)
    })
}
