//! Observes a running deployment from a process that is not part of it.

use core::time::Duration;
use std::io;
use std::time::Instant;

use iceoryx2::prelude::{CallbackProgression, Service as _, ipc};
use iceoryx2::service::ServiceListError;
use messages::{Metrics, topic};

use crate::lock::{ENDING_FILE, living};
use crate::remains::{all_locks, supervisor};
use crate::{Bus, BusError, Namespace, PortError, ReceiveError, Subscriber};
use failure::{ExitKind, Fault, Stop};

/// Pause between two checks of a deployment that is starting.
const PAUSE: Duration = Duration::from_millis(20);

/// Reason why a deployment cannot be observed.
#[derive(Debug, thiserror::Error)]
pub enum ObserverError {
    /// The deployment is not running, or is about to end.
    #[error("deployment {name:?} does not run")]
    NotRunning {
        /// Name of the deployment.
        name: String,
    },
    /// The deployment's shared memory cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The processes of the deployment cannot be listed.
    #[error(
        "cannot list the topics of deployment {name:?}: {}",
        failure::wording::spaced(source)
    )]
    List {
        /// Name of the deployment.
        name: String,
        /// Cause of the error.
        source: ServiceListError,
    },
    /// A metrics topic cannot be subscribed to, usually because there are too many observers already.
    #[error(transparent)]
    Port(#[from] PortError),
    /// Metrics cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The stop request cannot be set up.
    #[error("cannot prepare to stop")]
    Stop(#[source] io::Error),
}

impl Fault for ObserverError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::NotRunning { .. } => ExitKind::Usage,
            _ => ExitKind::Run,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::NotRunning { .. } => Some("`parallax status` shows what runs".to_owned()),
            Self::Port(_) => {
                Some("at most four programs may watch a deployment at the same time".to_owned())
            }
            Self::Bus(_) | Self::List { .. } | Self::Receive(_) | Self::Stop(_) => None,
        }
    }
}

/// The state of one process.
#[derive(Debug, Clone, Copy)]
pub struct ObservedProcess<'a> {
    /// Name of the process.
    pub process: &'a str,
    /// Process id, while the process is alive.
    pub pid: Option<u32>,
    /// Last metrics message of the process, possibly from before a restart. Check it, because it comes from another process.
    pub metrics: Option<&'a Metrics>,
}

/// Observes a running deployment: its processes, which of them are alive, and their metrics.
///
/// The deployment ends without waiting for observers. The observer must be dropped within a second after the end ([`Self::is_over`]).
#[derive(Debug)]
pub struct Observer {
    processes: Vec<Watched>,
    supervisor: u32,
    // Dropped last, because the subscribers use its ports.
    bus: Bus,
}

#[derive(Debug)]
struct Watched {
    process: String,
    subscriber: Subscriber<Metrics>,
    pid: Option<u32>,
    metrics: Option<Metrics>,
}

impl Observer {
    /// Starts the observation.
    ///
    /// # Errors
    ///
    /// Returns an [`ObserverError`] on failure.
    pub fn open(namespace: &Namespace) -> Result<Self, ObserverError> {
        let not_running = || ObserverError::NotRunning {
            name: namespace.name().to_owned(),
        };
        // Checked before anything is opened, because opening creates files.
        let supervisor = running_supervisor(namespace).ok_or_else(not_running)?;
        Self::open_of(namespace, supervisor)
            .map_err(|error| unless_over((namespace, supervisor), error, not_running))
    }

    fn open_of(namespace: &Namespace, supervisor: u32) -> Result<Self, ObserverError> {
        let stop = Stop::new().map_err(ObserverError::Stop)?;
        let name = format!("observer-{}", std::process::id());
        let bus = Bus::open(namespace, &name, &stop)?.as_onlooker();
        let mut processes = processes(namespace)?;
        processes.sort();
        let mut waiter = bus.waiter();
        let processes = processes
            .into_iter()
            .map(|process| {
                let subscriber = bus.subscriber(&topic::metrics(&process), &mut waiter)?;
                Ok(Watched {
                    process,
                    subscriber,
                    pid: None,
                    metrics: None,
                })
            })
            .collect::<Result<_, PortError>>()?;
        Ok(Self {
            processes,
            supervisor,
            bus,
        })
    }

    /// Returns the id of the process that runs the deployment.
    pub fn supervisor(&self) -> u32 {
        self.supervisor
    }

    /// Returns the current state of every process.
    ///
    /// # Errors
    ///
    /// Returns [`ObserverError::Bus`] or [`ObserverError::Receive`].
    pub fn observe(&mut self) -> Result<Vec<ObservedProcess<'_>>, ObserverError> {
        let config = self.bus.namespace().config().map_err(BusError::from)?;
        let living = living(&config);
        for watched in &mut self.processes {
            let node = living.iter().flatten().find(|(name, _)| *name == watched.process);
            watched.pid = node.map(|(_, pid)| *pid);
            if let Some(metrics) = watched.subscriber.latest()? {
                watched.metrics = Some(metrics);
            }
        }
        let observed = self.processes.iter().map(|watched| ObservedProcess {
            process: &watched.process,
            pid: watched.pid,
            metrics: watched.metrics.as_ref(),
        });
        Ok(observed.collect())
    }

    /// Returns true if the deployment is ending, so that this observer has to be dropped.
    pub fn is_over(&self) -> bool {
        running_supervisor(self.bus.namespace()) != Some(self.supervisor)
    }
}

/// Waits until a starting deployment has written its description ([`Namespace::description`]). Before that, some of its topics may
/// be missing.
///
/// Returns true if there is a description. Returns at once if the deployment does not run.
pub fn wait_for_description(namespace: &Namespace, patience: Duration) -> bool {
    let begin = Instant::now();
    loop {
        if running_supervisor(namespace).is_none() {
            return false;
        }
        if namespace.description().is_ok() {
            return true;
        }
        if begin.elapsed() >= patience {
            return false;
        }
        std::thread::sleep(PAUSE);
    }
}

/// Returns `error` if the deployment is still running. Otherwise, returns `not_running`, because the error was caused by the end of the
/// deployment.
///
/// * The first argument is the deployment and the supervisor that it had.
pub(crate) fn unless_over<E>(
    (namespace, supervisor): (&Namespace, u32),
    error: E,
    not_running: impl FnOnce() -> E,
) -> E {
    if running_supervisor(namespace) == Some(supervisor) {
        error
    } else {
        not_running()
    }
}

/// Returns the supervisor of a deployment, unless the deployment is ending.
pub(crate) fn running_supervisor(namespace: &Namespace) -> Option<u32> {
    if namespace.root().join(ENDING_FILE).exists() {
        return None;
    }
    supervisor(namespace, &all_locks())
}

/// Returns the names of all processes of a deployment, taken from its metrics topics.
fn processes(namespace: &Namespace) -> Result<Vec<String>, ObserverError> {
    let config = namespace.config().map_err(BusError::from)?;
    let mut processes = Vec::new();
    let listed = ipc::Service::list(&config, |service| {
        let name = service.static_details.name();
        processes.extend(topic::process_of_metrics(name).map(str::to_owned));
        CallbackProgression::Continue
    });
    listed.map_err(|source| ObserverError::List {
        name: namespace.name().to_owned(),
        source,
    })?;
    Ok(processes)
}
